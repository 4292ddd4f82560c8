"""A region ready to be searched in any scene: what of it is compared, and how thoroughly."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from imop.geometry import se3
from imop.geometry.cloud import farthest_points, inside_box
from imop.geometry.clusters import connected
from imop.geometry.neighbours import nearest
from imop.policy.evidence import Template
from imop.policy.matcher import Scene
from imop.policy.region import Region
from imop.policy.symmetry import half_turn
from imop.types import BoolArray, FloatArray

# What is farther than this (metres) from where a region may be has nothing to say about it.
BESIDE = 0.08


@dataclass(frozen=True)
class SearchConfig:
    """How thoroughly to search, and what is preferred among equally good explanations.

    Attributes:
        refined: how many seeds are refined by closest points.
        judged: how many of the refined motions, those that look best at a glance, are judged.
        finished: how many of the refined motions get the finest stage too.
        righted: how many of the best are set upright, too.
        turned: how many of the best are tried half a turn off, too: long things have two ends.
        turn: share of its score that a hypothesis loses for half a turn off the demonstrated motion.
        tilt: share that it loses for tilting things by `inquiry.TILTED` or more; twice for turning them over.
        change: share that it loses for another pose than the demonstrated motion leads to, once begun.
        sure: score from which a trusted motion needs no search.
        opinion: what full support by the matcher's opinion adds to the score when motions are compared.
    """

    refined: int = 12
    judged: int = 10
    finished: int = 4
    righted: int = 12
    turned: int = 0
    turn: float = 0.03
    tilt: float = 0.35
    change: float = 0.12
    sure: float = 0.7
    opinion: float = 0.1


class Search:
    """Searches the region of one demonstrated step in observed scenes.

    Args:
        config: how.
        before: the demonstrated scene.
        region: of the step, in that scene.
        loose: whether the region is a thing of its own, whatever it touches.
    """

    def __init__(self, config: SearchConfig, before: Scene, region: Region, loose: bool = False) -> None:
        self.config, self.region = config, region
        self.template = Template(region, tuple(before.observation.views.values()))
        self.center = region.cloud.points.mean(axis=0)
        self.T_world_gripper = before.observation.T_world_gripper
        self.coarse = [region.cloud.points[farthest_points(region.cloud.points, 400)]]
        if region.context is not None:
            # A thin part slides along itself; what it is fixed to holds it.
            self.coarse.append(region.whole.points[farthest_points(region.whole.points, 600)])
        self.fine = region.cloud.points[farthest_points(region.cloud.points, 1500)]
        self.half_turn = half_turn(region.cloud.points if loose else self._thing(before))

    def likely(self, query: Scene, hints: Sequence[FloatArray]) -> FloatArray:
        """(H, 4, 4) motions to look at in any case: hints, none at all, and what the gripper has done."""
        return np.stack([*hints, np.eye(4), self.repeated(query)])

    def repeated(self, query: Scene) -> FloatArray:
        """(4, 4) the motion of the gripper since the demonstration."""
        return query.observation.T_world_gripper @ se3.invert(self.T_world_gripper)

    def around(self, points: FloatArray, motions: FloatArray) -> BoolArray:
        """(N,) which points (N, 3) have to do with the region after any of the motions (H, 4, 4)."""
        return around(points, self.region.whole.points, motions)

    def _thing(self, before: Scene) -> FloatArray:
        """(N, 3) the thing in the demonstrated scene that the region is part of."""
        points = before.cloud.points[~before.ground.bare]
        if not len(points):
            return self.region.cloud.points
        labels = connected(points)
        part_of = labels[nearest(self.coarse[0], points)[1][:, 0]]
        thing: FloatArray = points[labels == np.bincount(part_of).argmax()]
        return thing


def around(points: FloatArray, thing: FloatArray, motions: FloatArray) -> BoolArray:
    """(N,) which points (N, 3) have to do with a thing (M, 3) after any of the motions (H, 4, 4)."""
    corners = np.stack(np.meshgrid(*np.stack([thing.min(axis=0), thing.max(axis=0)]).T), axis=-1)
    reached = np.zeros(len(points), dtype=bool)
    for box in se3.apply(motions, corners.reshape(-1, 3)):
        reached |= inside_box(points, box.min(axis=0) - BESIDE, box.max(axis=0) + BESIDE)
    return reached


def straightened(T: FloatArray, T_straight: FloatArray, p: FloatArray) -> FloatArray:
    """(4, 4) the motion `T_straight`, carried on to where `T` takes a point (3,)."""
    carried = T_straight.copy()
    carried[:3, 3] += (se3.apply(T, p[None]) - se3.apply(T_straight, p[None]))[0]
    return carried


def upright_motions(center: FloatArray, places: FloatArray, turns: int) -> FloatArray:
    """(P * turns, 4, 4) motions that carry `center` (3,) to places (P, 3), in all upright turns."""
    yaw = np.linspace(0.0, 2 * np.pi, turns, endpoint=False)
    R = np.tile(np.stack([se3.euler(z=float(angle)) for angle in yaw]), (len(places), 1, 1))
    return se3.make(R, np.repeat(places, turns, axis=0) - R @ center)
