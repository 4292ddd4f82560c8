"""Single predictions in simulated scenes: a cube onto a plate, shown once and asked elsewhere."""

from dataclasses import replace

import numpy as np
import pytest

from imop.evaluation.appearance import Appearance
from imop.evaluation.open_loop import Case, ask, region_iou
from imop.evaluation.oracle import OraclePolicy
from imop.evaluation.recordings import objects_world
from imop.evaluation.replay import ReplayPolicy
from imop.evaluation.trials import Trial
from imop.geometry import cloud as clouds
from imop.geometry import se3
from imop.geometry.accuracy import COARSE, FINE
from imop.geometry.perception import Perception
from imop.policy.interfaces import Candidate
from imop.policy.one_shot import OneShotPolicy
from imop.policy.router import Option
from imop.tasks.env import make_task
from imop.tasks.expert import record_demonstration

TASK, VARIATION = "tabletop/stack_cubes", 0


@pytest.fixture(scope="module")
def recorded():
    return [record_demonstration(make_task(TASK), seed, VARIATION, 0) for seed in (1_000_000, 0)]


@pytest.fixture(scope="module")
def case(recorded):
    shown, wanted = recorded
    appearance = Appearance(objects_world(Trial(TASK, 0, VARIATION)))
    return Case("stack_cubes", "shown", shown, {"itself": shown, "other": wanted}, appearance)


class Shifted:
    """Another policy's actions, moved in the world."""

    def __init__(self, policy, T):
        self._policy, self._T = policy, T
        self.watch, self.reset = policy.watch, policy.reset

    def act(self, observation):
        action = self._policy.act(observation)
        return replace(action, T_world_gripper=self._T @ action.T_world_gripper)


def test_the_oracle_is_always_right(case):
    rows = list(ask("oracle", OraclePolicy, case))
    assert len(rows) == 2 * len(case.demonstration) and all(row.within(FINE) for row in rows)
    assert [row.step for row in rows[: len(case.demonstration)]] == list(range(len(case.demonstration)))


def test_replay_is_right_where_it_was_shown_and_nowhere_else(case):
    rows = list(ask("replay", lambda _: ReplayPolicy(), case))
    assert all(row.within(FINE) == (row.query == "itself") for row in rows)
    assert all(row.plainly_within(FINE) == (row.query == "itself") for row in rows)


def test_three_centimetres_off_is_wrong(case):
    itself = replace(case, queries={"itself": case.demonstration})
    for shift in 0.03 * np.eye(3):
        rows = ask("replay", lambda _, p=shift: Shifted(ReplayPolicy(), se3.make(p=p)), itself)
        assert not any(row.within(COARSE) for row in rows)


def test_a_cube_may_be_taken_from_each_of_its_sides(case):
    first = case.demonstration.keyframes[0]
    for angle, right in ((np.pi / 2, True), (np.pi / 4, False)):
        turn = first.T_world_object @ se3.make(se3.euler(z=angle)) @ se3.invert(first.T_world_object)
        itself = replace(case, queries={"itself": case.demonstration})
        row = next(iter(ask("replay", lambda _, T=turn: Shifted(ReplayPolicy(), T), itself)))
        assert row.within(FINE) == right and not row.plainly_within(COARSE)
        plain = replace(itself, appearance=None)
        assert not next(iter(ask("replay", lambda _, T=turn: Shifted(ReplayPolicy(), T), plain))).within(
            COARSE
        )


class Everywhere:
    """A matcher that finds every region where it was, or nothing from step `until` on."""

    def __init__(self, until=100):
        self._until = until

    def prepare(self, steps):
        return [self.Step(step.before.cloud.points, k < self._until) for k, step in enumerate(steps)]

    class Step:
        def __init__(self, region, finds):
            self.region, self._finds = region, finds

        def locate(self, query, progress=None, feasible=None):
            points = np.zeros((3, 3))
            return (Candidate(np.eye(4), 1.0, points, points),) if self._finds else ()


class AlwaysFirst:
    """A router that never goes on, and notes what it is told."""

    def __init__(self):
        self.heard = []

    def watch(self, steps):
        self.heard.append(len(steps))

    def reset(self):
        self.heard.append("reset")

    def options(self, query):
        return (Option(0, 0),)

    def took(self, demonstration, step):
        self.heard.append(step)


def one_shot(router=None, until=100):
    # A cloud of one view is quickly made.
    return OneShotPolicy(Everywhere(until), Perception(max_points=1), router)


def test_the_policy_is_asked_for_the_same_step_whatever_its_router_says(case):
    steps = len(case.demonstration)
    itself = replace(case, queries={"itself": case.demonstration})
    rows = list(ask("one shot", lambda _: one_shot(), itself))
    assert all(row.within(FINE) and row.routed == row.step for row in rows)
    router = AlwaysFirst()
    rows = list(ask("one shot", lambda _: one_shot(router), itself))
    assert all(row.within(FINE) and row.routed == 0 for row in rows)
    assert router.heard == [steps, "reset", *range(steps)]


class Unnamed:
    """What other objects look like, but not what cameras see them as part of."""

    def __init__(self, appearance):
        self.turns, self.alike = appearance.turns, appearance.alike

    def instance(self, body):
        raise AssertionError("regions lie on what was demonstrated")


def test_regions_are_compared_with_the_demonstrated_objects_whatever_is_asked(case):
    others = {name: Unnamed(case.appearance) for name in case.queries}
    same, other = (
        [row.region_iou for row in ask("one shot", lambda _: one_shot(), asked)]
        for asked in (case, replace(case, others=others))
    )
    assert same == other and None not in same


def test_what_is_not_found_is_a_miss_and_the_recording_goes_on(case):
    itself = replace(case, queries={"itself": case.demonstration})
    rows = list(ask("one shot", lambda _: one_shot(until=2), itself))
    assert [row.within(FINE) for row in rows[:3]] == [True, True, False]
    assert all(row.problem and row.position is None for row in rows[2:])
    assert [row.routed for row in rows] == list(range(len(rows)))


def test_the_overlap_of_a_region_with_an_object(recorded):
    observation = recorded[0].keyframes[0].observation
    cloud = clouds.fuse(observation)
    number = {name: i for i, name in observation.instance_names.items()}
    cube = cloud.points[cloud.ids == number["target0/body"]]
    plate = cloud.points[cloud.ids == number["plate/body"]]
    assert region_iou(cube, observation, "target0/body") == 1
    thin = clouds.voxel_downsample(cloud.select(cloud.ids == number["target0/body"]), 0.01)
    assert region_iou(thin.points, observation, "target0/body") > 0.95
    assert region_iou(plate, observation, "target0/body") == 0
    assert region_iou(np.zeros((0, 3)), observation, "target0/body") == 0
    half = cube[cube[:, 0] < np.median(cube[:, 0])]
    assert 0.35 < region_iou(half, observation, "target0/body") < 0.85
    both = np.concatenate([cube, plate])
    assert region_iou(both, observation, "target0/body") == pytest.approx(len(cube) / len(both))
    assert region_iou(cube, observation.stripped(), "target0/body") is None


def test_a_step_counts_as_repeatable_if_the_state_gives_it_away(case):
    rows = {row.step: row for row in ask("oracle", OraclePolicy, case) if row.query == "other"}
    # Over the cube the demonstrated motion leads down to it; from the start it does not lead to the cube.
    assert not rows[0].repeatable and rows[1].repeatable
