"""Which turns leave a region looking the same, as far as one demonstration shows.

The networks match a round thing in some turn or other; then they have no opinion on which turn is right.
"""

from itertools import product

import numpy as np

from imop.geometry import se3
from imop.geometry.cloud import farthest_points
from imop.geometry.icp import Refiner, upright
from imop.geometry.neighbours import nearest
from imop.policy.evidence import Surface
from imop.types import FloatArray

TURNS = np.radians(np.arange(45.0, 360.0, 45.0))
HALF = np.pi
# Share of a region that has to look the same: seen from some sides only, round things reach no more.
ALIKE = 0.7
# How far off the middle of what was seen the axis may be, metres.
OFF = (-0.008, 0.0, 0.008)
POINTS = 200
# Axes of half turns that are tried, metres off the middle, how many of them are refined, and what is near.
AXES, REFINED, NEAR = (-0.05, -0.025, 0.0, 0.025, 0.05), 4, 0.012


def equal_turns(surface: Surface, center: FloatArray) -> FloatArray:
    """(S, 4, 4) turns about the vertical near `center` (3,) after which a surface looks the same.

    The first is the identity. A lone half turn is not counted: front and back of most things look alike
    from afar, and differ.
    """
    few = surface.cloud.select(farthest_points(surface.cloud.points, POINTS))
    weight = np.ones(len(few))
    found = []
    for angle in TURNS:
        R = se3.euler(z=float(angle))
        shifts = [np.array([x, y, 0.0]) for x, y in product(OFF, OFF)]
        motions = [se3.make(R, center - R @ center + shift) for shift in shifts]
        alike = [surface.share(few, weight, T, surface.explain(few, T)[0]) for T in motions]
        if max(alike) > ALIKE:
            found.append((angle, motions[int(np.argmax(alike))]))
    if all(np.isclose(angle, HALF) for angle, _ in found):
        found = []
    return np.stack([np.eye(4), *(T for _, T in found)])


def half_turn(points: FloatArray, near: float = NEAR) -> FloatArray:
    """(4, 4) the half turn about the vertical that best lays a thing (N, 3) onto itself, `near` in metres.

    Most things look alike from both ends, about an axis that need not go through the middle of what was seen:
    a faucet's goes through its base, whichever way the spout points.
    """
    few = points[farthest_points(points, POINTS)]
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    R = se3.euler(z=HALF)
    axes = [middle + np.array([x, y, 0.0]) for x, y in product(AXES, AXES)]
    motions = np.stack([se3.make(R, axis - R @ axis) for axis in axes])
    best = motions[np.argsort(-onto(few, points, motions, near), kind="stable")[:REFINED]]
    if len(points) >= 5:
        refine = Refiner(points)
        best = np.stack([*best, *(upright(refine(few, T), middle) for T in best)])
    chosen: FloatArray = best[np.argmax(onto(few, points, best, near))]
    return chosen


def onto(few: FloatArray, points: FloatArray, motions: FloatArray, near: float) -> FloatArray:
    """(H,) share of `few` points that motions (H, 4, 4) carry nearer than `near` (metres) to `points`."""
    moved = se3.apply(motions, few)
    distance = nearest(moved.reshape(-1, 3), points)[0].reshape(len(motions), -1)
    share: FloatArray = (distance < near).mean(axis=1)
    return share
