from dataclasses import replace

import numpy as np
import pytest

from imop.errors import ImopError, InvalidInput
from imop.types import Action, CameraView, Demonstration, Keyframe, Match, Observation

K = np.array([[40.0, 0, 16], [0, 40.0, 16], [0, 0, 1]])


def view(**changes):
    values = dict(
        rgb=np.zeros((32, 32, 3), np.uint8), depth=np.ones((32, 32)), intrinsics=K, T_world_camera=np.eye(4)
    )
    return CameraView(**{**values, **changes})


def observation(**changes):
    return Observation(
        **{**dict(views={"front": view()}, T_world_gripper=np.eye(4), gripper_opening=1.0), **changes}
    )


MIRROR = np.diag([1.0, 1.0, -1.0, 1.0])


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: view(intrinsics=np.eye(4)), "intrinsics"),
        (lambda: view(intrinsics=np.diag([-40.0, 40.0, 1.0])), "intrinsics"),
        (lambda: view(depth=np.ones((16, 32))), "depth"),
        (lambda: view(rgb=np.zeros((32, 32))), "rgb"),
        (lambda: view(rgb=np.full((32, 32, 3), 0.5)), "rgb: an array of float64.*0 to 255"),
        (lambda: view(rgb=np.full((32, 32, 3), 200.0)), "rgb: an array of float64"),
        (lambda: view(rgb=np.full((32, 32, 3), 256)), "rgb: integers from 256 to 256.*0 to 255"),
        (lambda: view(rgb=np.full((32, 32, 3), -1)), "rgb: integers from -1"),
        (lambda: view(rgb=[[[300, 0, 0]]], depth=[[1.0]]), "rgb"),
        (lambda: view(rgb=np.zeros((0, 0, 3), np.uint8), depth=np.zeros((0, 0))), "rgb.*at least one pixel"),
        (lambda: view(instance_ids=np.full((32, 32), 2**40)), "instance_ids"),
        (lambda: view(intrinsics=[[1, 1, 0], [1, 1, 0], [0, 0, 1]]), "intrinsics"),
        (lambda: view(intrinsics=[[1, np.inf, 0], [0, 1, 0], [0, 0, 1]]), "intrinsics"),
        (lambda: view(T_world_camera=2 * np.eye(4)), "T_world_camera"),
        (lambda: view(T_world_camera=1e300 * np.eye(4)), "T_world_camera"),
        (lambda: view(T_world_camera=MIRROR), "T_world_camera"),
        (lambda: view(instance_ids=np.zeros(3)), "instance_ids"),
        (lambda: observation(views={}), "views"),
        (lambda: observation(gripper_opening=80.0), "gripper_opening"),
        (lambda: observation(T_world_gripper=np.full((4, 4), np.nan)), "T_world_gripper"),
        (lambda: observation(T_world_gripper="here"), "T_world_gripper"),
        (lambda: observation(joint_positions=np.eye(7)), "joint_positions"),
        (lambda: observation(joint_positions=[0, np.nan]), "joint_positions"),
        (lambda: observation(joint_velocities=[np.inf]), "joint_velocities"),
        (lambda: observation(gripper_opening=np.nan), "gripper_opening"),
        (lambda: Action(np.eye(4), True, confidence=1.5), "confidence"),
        (lambda: Action(np.eye(3), True), "T_world_gripper"),
        (lambda: Match(0, np.zeros((4, 3)), np.zeros((5, 3)), np.zeros((0, 3))), "p_query"),
        (lambda: Demonstration((), observation()), "keyframe"),
        (lambda: Keyframe(observation(), Action(np.eye(4), True), T_world_object=MIRROR), "T_world_object"),
    ],
)
def test_bad_values_are_refused_by_name(make, field):
    with pytest.raises(InvalidInput, match=field) as caught:
        make()
    assert isinstance(caught.value, ImopError) and "accepted" in str(caught.value)


def test_values_cannot_be_changed_from_outside():
    depth = np.ones((32, 32), np.float32)
    frozen = view(depth=depth)
    depth[:] = 7
    assert frozen.depth.max() == 1
    with pytest.raises(ValueError, match="read-only"):
        frozen.depth[0, 0] = 2


def test_colours_may_be_any_integers_that_fit():
    assert view(rgb=np.full((32, 32, 3), 255)).rgb.dtype == np.uint8
    assert view(rgb=[[[0, 128, 255]]], depth=[[1.0]]).rgb.tolist() == [[[0, 128, 255]]]


def test_unmeasured_depth_is_allowed_and_known():
    depth = np.ones((32, 32))
    depth[0, :3] = 0, np.nan, np.inf
    assert np.count_nonzero(~view(depth=depth).measured) == 3


def test_steps_end_in_the_next_observation():
    first, second, final = (observation(time_step=k) for k in range(3))
    action = Action(np.eye(4), True)
    demo = Demonstration((Keyframe(first, action), Keyframe(second, action)), final)
    assert len(demo) == 2 and demo.after(0) is second and demo.after(1) is final


def test_stripping_leaves_only_what_a_robot_knows():
    ids = replace(view(), instance_ids=np.ones((32, 32), int))
    told = observation(views={"front": ids}, joint_velocities=np.ones(7), instance_names={1: "lid"})
    demo = Demonstration(
        (Keyframe(told, Action(np.eye(4), True), "lid", np.eye(4)),), told, "tabletop/x", 2, ("do",)
    )
    bare = demo.stripped()
    assert (bare.task, bare.variation, bare.instructions) == ("", 0, ("do",))
    assert bare.keyframes[0].object_name is None and bare.keyframes[0].T_world_object is None
    for seen in (bare.keyframes[0].observation, bare.final):
        assert seen.instance_names is None and seen.joint_velocities is None
        assert seen.views["front"].instance_ids is None
