"""Turns about the vertical after which a thing looks the same, or nearly."""

from itertools import product

import numpy as np

from imop.geometry import se3
from imop.geometry.cloud import farthest_points, middle
from imop.geometry.icp import Refiner, upright
from imop.geometry.neighbours import nearest
from imop.types import FloatArray

# Share of a thing that has to look the same after a turn, and how near that is, metres.
ALIKE, NEAR = 0.8, 0.006
# Points that are compared, and how far off the middle of what was seen the axis may be, metres.
POINTS, OFF = 200, 0.008
# The same of a half turn, and how many axes are refined.
AXES, REFINED = 0.05, 4
# Equal turns are looked for in these steps, radians.
STEP = np.pi / 4


def upright_motions(center: FloatArray, places: FloatArray, turns: int) -> FloatArray:
    """(P * turns, 4, 4) motions that carry `center` (3,) to places (P, 3), in all upright turns."""
    yaw = np.linspace(0.0, 2 * np.pi, turns, endpoint=False)
    R = np.tile(np.stack([se3.euler(z=float(angle)) for angle in yaw]), (len(places), 1, 1))
    return se3.make(R, np.repeat(places, turns, axis=0) - R @ center)


def turn_about(axis: FloatArray, angle: float) -> FloatArray:
    """(4, 4) the turn by an angle, radians, about the vertical through `axis` (3,)."""
    R = se3.euler(z=angle)
    return se3.make(R, axis - R @ axis)


def equal_turns(points: FloatArray) -> FloatArray:
    """(S, 4, 4) turns about the vertical after which a thing (N, 3) looks the same; the first is none.

    Of round things the networks match any side to any. A lone half turn is not counted: front and back of
    most things look alike from afar, and differ.
    """
    few, center, found = points[farthest_points(points, POINTS)], middle(points), []
    for angle in np.arange(1, 8) * STEP:
        R = se3.euler(z=float(angle))
        motions = np.stack([se3.make(R, center - R @ center + (x, y, 0.0)) for x, y in _around(OFF, 3)])
        alike = onto(few, points, motions)
        if alike.max() > ALIKE:
            found.append((angle, motions[int(np.argmax(alike))]))
    if all(np.isclose(angle, np.pi) for angle, _ in found):
        found = []
    return np.stack([np.eye(4), *(T for _, T in found)])


def axis_of_round(turns: FloatArray) -> FloatArray | None:
    """(3,) a point of the axis that equal `turns` (S, 4, 4) are about; None if they are not of a round thing.

    A box looks the same after quarter turns at most. What is seen from one side only does not in every turn.
    """
    angles = se3.rotation_distance(turns, np.eye(4)) / STEP
    if not np.any(np.round(angles) % 2 == 1):
        return None
    half = turns[np.argmax(angles)]
    return np.append(np.linalg.solve(np.eye(2) - half[:2, :2], half[:2, 3]), 0.0)


def half_turn(points: FloatArray) -> FloatArray:
    """(4, 4) the half turn about the vertical that best lays a thing (N, 3) onto itself.

    Most things look alike from both ends, about an axis that need not go through the middle of what was seen:
    a faucet's goes through its base, whichever way the spout points.
    """
    few, center = points[farthest_points(points, POINTS)], middle(points)
    motions = np.stack([turn_about(center + np.array([x, y, 0.0]), np.pi) for x, y in _around(AXES, 5)])
    best = motions[np.argsort(-onto(few, points, motions), kind="stable")[:REFINED]]
    if len(points) >= 5:
        refine = Refiner(points)
        best = np.stack([*best, *(upright(refine(few, T), center) for T in best)])
    chosen: FloatArray = best[np.argmax(onto(few, points, best))]
    return chosen


def _around(far: float, count: int) -> list[tuple[float, float]]:
    """Offsets in a square grid of `count` rows, up to `far` to each side."""
    side = np.linspace(-far, far, count).tolist()
    return list(product(side, side))


def onto(few: FloatArray, points: FloatArray, motions: FloatArray) -> FloatArray:
    """(H,) share of `few` points that motions (H, 4, 4) carry nearer than `NEAR` to `points`."""
    moved = se3.apply(motions, few)
    distance = nearest(moved.reshape(-1, 3), points)[0].reshape(len(motions), -1)
    share: FloatArray = (distance < NEAR).mean(axis=1)
    return share


def peak(angles: FloatArray, fits: FloatArray) -> float:
    """The angle at which a parabola through `fits` (N,) at `angles` (N,) is highest.

    It is the best of the given ones if there is no such place between them.
    """
    a, b, _ = np.polyfit(angles, fits, 2)
    top = -b / (2 * a) if a < 0 else np.inf
    return float(top if angles.min() <= top <= angles.max() else angles[np.argmax(fits)])
