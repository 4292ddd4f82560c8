"""One search in one scene: cheap generators first, until a candidate is likely enough."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from imop.geometry import se3
from imop.geometry.cloud import PointCloud, farthest_points, middle
from imop.geometry.icp import SMALLEST, upright
from imop.geometry.neighbours import within
from imop.geometry.turns import axis_of_round, equal_turns, half_turn, upright_motions
from imop.policy.contacts import SAME
from imop.policy.evidence import Template
from imop.policy.interfaces import BEGINNING, Candidate, Feasible, PolicyConfig, Progress, Scene, Transition
from imop.policy.proposals import Asked, straightened
from imop.policy.region import Goal, Region
from imop.policy.target import BESIDE, Target, around, find_goal, obstacles, thing_of
from imop.policy.verification import Part, Pool, Sought, Verifier
from imop.types import FloatArray


class StepSearch:
    """A demonstrated step, searched in any number of scenes.

    Args:
        config: how thoroughly.
        step: the demonstrated one.
        region: of it.
        payload: what the hand takes next, if it is less than the region.
        verifier: gives probabilities.
        ask: the matcher's opinion of a scene; it is asked only if what was done before does not suffice.
    """

    def __init__(
        self,
        config: PolicyConfig,
        step: Transition,
        region: Region,
        payload: PointCloud | None,
        verifier: Verifier,
        ask: Callable[[Scene], Asked],
    ) -> None:
        before, T_goal = step.before, step.action.T_world_gripper
        views = tuple(before.observation.views.values())
        standing = before.cloud.select(~before.ground.bare)
        beside, goal = _beside(standing, T_goal, region, config), find_goal(step, region, config)
        others = standing.colors[~within(standing.points, region.whole.points, SAME)]
        template = Template(region, T_goal[:3, 3], beside, views, config, payload, goal, others)
        parts = _parts(region, payload, goal, T_goal[:3, 3], config)
        turns = equal_turns(region.cloud.points)
        half = half_turn(thing_of(parts[0].coarse, standing.points))
        axis = axis_of_round(turns)
        self.sought = Sought(config, step, region, template, parts, turns, axis, half, verifier)
        self._ask = ask
        # All of it, what stays in place on another thing, and what is next to the gripper.
        self._precise = [part for part in parts if part.name in ("region", "firm", "part")]
        # What is around the goal is evidence, too.
        around_goal = np.zeros((0, 3)) if goal is None else goal.cloud.points
        self._concerned = np.concatenate([region.whole.points, around_goal, T_goal[None, :3, 3]])

    def locate(
        self, query: Scene, progress: Progress = BEGINNING, feasible: Feasible | None = None
    ) -> tuple[Candidate, ...]:
        """Where the region may be in the query, likeliest first; see `PreparedStep.locate`."""
        ranked: tuple[Candidate, ...] = ()
        pool: Pool | None = None
        for pool in self.pools(query, progress):
            ranked = self._reachable_first(pool.ranked(progress.tried), feasible)
            enough = ranked and ranked[0].probability >= self.sought.config.enough
            if enough and ranked[0].reachable is not False:
                break
        if pool is None or not ranked:
            return ()
        best, *others = ranked
        # What is settled anew would come to where it came to before.
        return pool.explained(best if progress.tried else pool.settled(best)), *others

    def _reachable_first(
        self, ranked: tuple[Candidate, ...], feasible: Feasible | None
    ) -> tuple[Candidate, ...]:
        """The likeliest candidate that the arm can follow before all others."""
        if feasible is None or not ranked:
            return ranked
        for i, candidate in enumerate(ranked):
            if feasible(se3.orthonormal(candidate.T_query_support @ self.sought.T_goal)):
                return (replace(candidate, reachable=True), *ranked[:i], *ranked[i + 1 :])
        return (replace(ranked[0], reachable=False), *ranked[1:])

    def pools(self, query: Scene, progress: Progress) -> Iterator[Pool]:
        """The candidates after each stage, cheap ones first; every pool holds those before it."""
        if len(query.fused) < SMALLEST:
            return
        before, T_last = self.sought.step.before, progress.T_last
        T_repeated = query.observation.T_world_gripper @ se3.invert(before.observation.T_world_gripper)
        stands = obstacles(query, self.sought.region)
        standing = query.fused.select(stands)
        if T_last is not None:
            near = standing.select(around(standing.points, self._concerned, np.stack([T_last, T_repeated])))
            if len(near) >= SMALLEST:
                pool = Pool(self.sought, Target(query, near), standing.points, T_last, T_repeated, None)
                self._followed(pool)
                yield pool
        if len(standing) < SMALLEST:
            return
        target, asked = Target(query, query.cloud.select(stands)), self._ask(query)
        pool = Pool(self.sought, target, standing.points, T_last, T_repeated, asked)
        self._followed(pool)
        stages = [self._searched, self._anywhere]
        if pool.asked and pool.asked.fits:
            stages.insert(0, self._fitted)
        for generate in stages:
            generate(pool)
            yield pool

    def _followed(self, pool: Pool) -> None:
        """What was done before goes on."""
        T_last, T_goal = pool.T_last, self.sought.T_goal
        if T_last is not None:
            pool.add("hint", [T_last, *self._laid(pool, T_last)])
        # Mostly the hand went where it was sent, and both are the same.
        gone = pool.T_repeated @ T_goal
        if T_last is None or not se3.near(T_last @ T_goal, gone, *self.sought.config.same_motion):
            pool.add("gripper", [pool.T_repeated, *self._laid(pool, pool.T_repeated)])

    def _laid(self, pool: Pool, T: FloatArray) -> list[FloatArray]:
        """Motions (4, 4) next to `T` that lay what has to fit exactly onto the scene, part by part."""
        return [pool.finished(part, T) for part in self._precise]

    def _fitted(self, pool: Pool) -> None:
        """What most matches agree on."""
        assert pool.asked is not None
        for name, T in pool.asked.fits.items():
            pool.add(name, [pool.moved(part, T) for part in self.sought.parts[:2]])
        self._turned(pool)

    def _searched(self, pool: Pool) -> None:
        """What some matches agree on, for each part of the region."""
        assert pool.asked is not None
        config = self.sought.config
        for part in self.sought.parts:
            matches = pool.asked.matches.of(part.fine)
            if part.name != "firm":
                upright_on = matches.upright(pool.target, config.places, config.turns, part.middles)
                seeds = [matches.motions(config.samples), upright_on]
                pool.search(part, np.concatenate(seeds))
        self._turned(pool)

    def _anywhere(self, pool: Pool) -> None:
        """Every thing, in every turn: the matches may be of a wrong one."""
        config = self.sought.config
        places = pool.target.places(config.fewest)
        if len(places):
            for part in self.sought.parts:
                if part.name != "firm":
                    seeds = upright_motions(part.middles[0], places, config.turns)
                    pool.search(part, seeds, "goal" if part.name == "goal" else "anywhere")
            self._turned(pool)

    def _turned(self, pool: Pool) -> None:
        """The best so far laid down exactly, in turns that look alike, straight, and upright."""
        whole, center = self.sought.parts[0], self.sought.center
        found: dict[str, list[FloatArray]] = {"half_turn": [], "straight": [], "upright": [], "exact": []}
        best = pool.best(self.sought.config.tried)
        # Which turn of a round thing is meant, its marks may say, or the arm, which cannot reach them all.
        for T in best[:1]:
            found["turn"] = [pool.turns.kept(M, pool.finished(whole, M)) for M in pool.turns.best(T)]
            found["turn"] += [pool.moved(whole, T @ S) for S in self.sought.turns[1:]]
        for T in best:
            found["exact"] += self._laid(pool, T)
            found["upright"].append(upright(T, center))
            straight = straightened(T, pool.T_repeated, center)
            for name, other in (("half_turn", T @ self.sought.half), ("straight", straight)):
                moved = pool.moved(whole, other)
                found[name] += [moved, upright(moved, center)]
        for name, motions in found.items():
            pool.add(name, motions)


def _parts(
    region: Region,
    payload: PointCloud | None,
    goal: Goal | None,
    p_goal: FloatArray,
    config: PolicyConfig,
) -> tuple[Part, ...]:
    """The region, what of it stays in place, what is next to the gripper, what it takes, where it goes."""
    points = region.cloud.points
    middles = (middle(points),) if region.context is None else (middle(points), middle(region.whole.points))
    coarse, fine = config.laid
    rng = np.random.default_rng(0)
    share = region.trust / region.trust.sum()
    drawn = rng.choice(len(points), min(fine, 4 * len(points)), p=share)
    parts = [
        _part("region", 0, points, middles, config),
        Part("firm", 3, points[drawn[:coarse]], points[drawn], middles),
    ]
    near = region.next_to(p_goal, config.next_to).cloud.points
    if SMALLEST <= len(near) < config.alone * len(points):
        parts.append(_part("part", 2, near, (middle(near),), config))
    if payload is not None:
        parts.append(_part("payload", 4, payload.points, (middle(payload.points),), config))
    if goal is not None:
        parts.append(_part("goal", 5, goal.cloud.points, (middle(goal.thing),), config))
    return tuple(parts)


def _part(
    name: str, column: int, points: FloatArray, middles: tuple[FloatArray, ...], config: PolicyConfig
) -> Part:
    coarse, fine = (points[farthest_points(points, count)] for count in config.laid)
    return Part(name, column, coarse, fine, middles)


def _beside(standing: PointCloud, T_goal: FloatArray, region: Region, config: PolicyConfig) -> PointCloud:
    """What stands around the place that the tip goes to; the region if nothing does."""
    near = np.linalg.norm(standing.points - T_goal[:3, 3], axis=1) < BESIDE
    cloud = standing.select(near) if near.any() else region.cloud
    return cloud.select(farthest_points(cloud.points, config.compared[1]))
