import numpy as np
import pytest

from imop.demos.frames import moved
from imop.errors import InvalidInput
from imop.geometry import se3
from imop.geometry.cloud import fuse
from tests.demos.scenes import lift_a_cube

T = se3.make(se3.euler(z=0.7), (0.3, -0.1, -0.75))


def test_the_scene_moves_with_the_frame():
    before, after = lift_a_cube(), moved(lift_a_cube(), T)
    for a, b in zip(before.keyframes, after.keyframes, strict=True):
        assert np.allclose(se3.apply(T, fuse(a.observation).points), fuse(b.observation).points, atol=1e-9)
        assert np.allclose(T @ a.action.T_world_gripper, b.action.T_world_gripper)
        assert np.allclose(T @ a.T_world_object, b.T_world_object)
    assert np.allclose(T @ before.final.T_world_gripper, after.final.T_world_gripper)


def test_what_is_moved_back_is_where_it_was():
    back = moved(moved(lift_a_cube(), T), se3.invert(T))
    for a, b in zip(lift_a_cube().keyframes, back.keyframes, strict=True):
        assert np.allclose(a.action.T_world_gripper, b.action.T_world_gripper, atol=1e-12)


def test_a_mirror_is_no_frame():
    with pytest.raises(InvalidInput, match="T_new_world"):
        moved(lift_a_cube(), np.diag([1.0, 1.0, -1.0, 1.0]))
