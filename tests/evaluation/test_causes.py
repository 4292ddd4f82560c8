"""What is said of failed episodes."""

from dataclasses import replace

import numpy as np
import pytest

from imop.evaluation.appearance import Appearance
from imop.evaluation.causes import Cause, _Acted, _first, diagnose, right_poses
from imop.evaluation.steps import Rollout, Step
from imop.evaluation.trials import Trial, demonstration_for
from imop.geometry import se3
from imop.tasks.tabletop.close_laptop import CloseLaptop

TRIAL = Trial("tabletop/stack_cubes", 3)


@pytest.fixture(scope="module")
def demonstration():
    return demonstration_for(TRIAL)


def acted(*wrong, on_object=1.0):
    return [_Acted(k, (0.1 if w else 0.0, 0.0), on_object, None) for k, w in enumerate(wrong)]


def ended(count, plan_failed=None):
    steps = [Step(k, None, None, 1.0, 0.0, 0.0) for k in range(count)]
    steps[-1] = replace(steps[-1], plan_failed=plan_failed)
    return Rollout(False, "task not done after the last action", tuple(steps))


@pytest.mark.parametrize(
    ("actions", "result", "cause", "number"),
    [
        (acted(False, True, True), ended(3), Cause.MATCH, 1),
        (acted(True, False, on_object=0.2), ended(2), Cause.REGION, 0),
        (acted(False, False), ended(2), Cause.PHYSICS, 1),
        (acted(False, False), ended(2, "unreachable"), Cause.PLAN, 1),
        (acted(False, True), ended(2, "unreachable"), Cause.MATCH, 1),
        ([], Rollout(False, "no confident match", ()), Cause.OTHER, 0),
    ],
)
def test_the_first_wrong_action_tells_the_cause(actions, result, cause, number):
    found = _first(actions, result)
    assert (found.cause, found.action) == (cause, number)


def test_another_step_than_the_next_is_a_wrong_route():
    actions = acted(False, False, False)
    actions[1] = replace(actions[1], step=2)
    assert _first(actions, ended(3)).cause == Cause.ROUTE


def test_right_poses_move_with_the_object(demonstration):
    env = TRIAL.env()
    keyframe = demonstration.keyframes[0]
    right = right_poses(demonstration, 0, env.world, Appearance(env.world))
    wanted = env.world.pose(keyframe.object_name) @ se3.invert(keyframe.T_world_object)
    wanted = wanted @ keyframe.action.T_world_gripper
    assert se3.translation_distance(wanted, right).min() < 1e-9


def test_replay_fails_because_it_goes_to_the_wrong_place(demonstration):
    found = diagnose(TRIAL, demonstration, "replay")
    assert found is not None and found.cause == Cause.MATCH and found.off[0] > 0.02
    assert found.panel is not None and np.isfinite(found.off).all()


def test_poses_carried_over_to_another_laptop_are_right_and_those_of_another_place_are_not(monkeypatch):
    trial = Trial("tabletop/close_laptop", 1, 0, 1, shown=0)
    demonstration = demonstration_for(trial)
    monkeypatch.setattr(CloseLaptop, "success", lambda *_: False)
    found = diagnose(trial, demonstration, "oracle")
    assert found is not None and found.cause in (Cause.PHYSICS, Cause.PLAN) and found.off[0] < 1e-6
    replayed = diagnose(trial, demonstration, "replay")
    assert replayed is not None and replayed.cause == Cause.MATCH and replayed.action == 0
