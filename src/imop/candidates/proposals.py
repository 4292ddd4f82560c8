"""Where the region may have gone: motions that are worth a look, by who proposes them.

| generator | proposes |
|---|---|
| `hint` | the motion of the step before |
| `gripper` | what the gripper has done since the demonstration, for what it holds |
| `fit` | what most matches agree on, by least squares over all points of the region |
| `firm` | the same, weighted by how little each point may differ |
| `matches` | what some matches agree on, by sampled triples |
| `upright` | every turn on the things that most matches lead to |
| `anywhere` | every turn on every thing |
| `half_turn` | half a turn after what was found |
| `straight` | what was found, turned as the gripper was in the demonstration |
| `part`, `payload` | the same as `matches` and `upright` for what is next to the gripper, and what it takes |
"""

from itertools import product

import numpy as np

from imop.geometry import se3
from imop.geometry.cloud import PointCloud, farthest_points
from imop.geometry.clusters import connected
from imop.geometry.neighbours import nearest
from imop.policy.symmetry import OFF, POINTS, onto
from imop.policy.things import middle
from imop.types import FloatArray

# Upright turns of one place, and how many things the region is set upright on by its matches.
TURNS, PLACES = 24, 2
# Triples of matches that are drawn, and the seed of the draw.
SAMPLES, SEED = 4000, 0
# Share of a thing that has to look the same after a turn, and how near that is, metres.
ALIKE, NEAR = 0.8, 0.006


def equal_turns(cloud: PointCloud) -> FloatArray:
    """(S, 4, 4) turns about the vertical after which a region looks the same; the first is the identity.

    Of round things the networks match any side to any. A lone half turn is not counted: front and back of
    most things look alike from afar, and differ.
    """
    points, center = cloud.points, middle(cloud.points)
    few, found = points[farthest_points(points, POINTS)], []
    for angle in np.radians(np.arange(45.0, 360.0, 45.0)):
        R = se3.euler(z=float(angle))
        motions = np.stack([se3.make(R, center - R @ center + (x, y, 0.0)) for x, y in product(OFF, OFF)])
        alike = onto(few, points, motions, NEAR)
        if alike.max() > ALIKE:
            found.append((angle, motions[int(np.argmax(alike))]))
    if all(np.isclose(angle, np.pi) for angle, _ in found):
        found = []
    return np.stack([np.eye(4), *(T for _, T in found)])


def thing_of(points: FloatArray, standing: FloatArray) -> FloatArray:
    """(N, 3) the connected thing among `standing` points (M, 3) that most of `points` are part of."""
    if not len(standing):
        return points
    labels = connected(standing)
    part_of = labels[nearest(points, standing)[1][:, 0]]
    thing: FloatArray = standing[labels == np.bincount(part_of).argmax()]
    return thing
