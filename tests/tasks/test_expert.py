import numpy as np
import pytest

from imop.errors import ImopError
from imop.geometry import se3
from imop.tasks.env import make_task
from imop.tasks.expert import ExpertFailed, perform, record_demonstration
from imop.tasks.grasps import from_above
from imop.tasks.tabletop.lid_off_pot import LidOffPot
from imop.tasks.task import make_scene
from imop.tasks.waypoint import Waypoint


@pytest.fixture(scope="module")
def demo():
    return record_demonstration(make_task("tabletop/lid_off_pot"), 3, instance_seed=4)


def test_keyframes_hold_what_was_seen_before_and_where_the_gripper_went(demo):
    for step, keyframe in enumerate(demo.keyframes):
        assert keyframe.observation.time_step == step
        reached = demo.after(step).T_world_gripper
        assert se3.translation_distance(keyframe.action.T_world_gripper, reached) < 0.002
    assert [k.action.gripper_open for k in demo.keyframes] == [True, False, False]
    assert demo.seeds == {"instance": 4, "episode": 3}
    assert demo.task == "tabletop/lid_off_pot"
    assert demo.instructions[0] == "take the lid off the pot"


def test_the_grasp_is_the_same_in_the_objects_frame_in_every_scene(demo):
    other = record_demonstration(make_task("tabletop/lid_off_pot"), 8, instance_seed=4)
    for a, b in zip(demo.keyframes, other.keyframes, strict=True):
        assert a.object_name == b.object_name == "lid/body"
        in_frame = [se3.invert(k.T_world_object) @ k.action.T_world_gripper for k in (a, b)]
        assert se3.translation_distance(*in_frame) < 0.002
        assert se3.rotation_distance(*in_frame) < 0.02
        assert se3.translation_distance(a.action.T_world_gripper, b.action.T_world_gripper) > 0.02


def test_the_final_observation_shows_the_lid_lifted(demo):
    lid = next(i for i, name in demo.final.instance_names.items() if name == "lid/body")

    def height(observation):
        view = observation.views["front"]
        rows, _ = np.nonzero(view.instance_ids == lid)
        return rows.mean()

    assert height(demo.final) < height(demo.keyframes[0].observation) - 5


class NoLift(LidOffPot):
    """Its expert does nothing useful."""

    def waypoints(self, world):
        return super().waypoints(world)[:1]


class TooHigh(LidOffPot):
    """Its last waypoint is out of reach, which the scene does not show."""

    checked = True

    def waypoints(self, world):
        steps = list(super().waypoints(world))
        return steps if self.checked else [*steps, Waypoint("lid/body", from_above((0, 0, 3.0)), False)]


def test_an_expert_that_misses_the_aim_or_finds_no_motion_says_so():
    with pytest.raises(ExpertFailed, match="not the aim"):
        record_demonstration(NoLift(), 0)
    task = TooHigh()
    world = make_scene(task, 0, 0, 0)
    task.checked = False
    with pytest.raises(ExpertFailed, match="outside_workspace") as caught:
        perform(task, world)
    assert caught.value.step == 3
    assert isinstance(caught.value, ImopError)
