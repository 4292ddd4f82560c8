import warnings
from dataclasses import replace

import numpy as np
import pytest

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.geometry.perception import Perception, SelfFilterWarning
from imop.geometry.self_filter import box
from imop.robots.panda import PANDA_HOME_Q as Q
from imop.robots.panda import T_WORLD_BASE, panda_self_filter, tip_pose
from imop.sim.cameras import observe
from imop.sim.kinematics import inverse_kinematics
from imop.sim.world import World, scene_spec
from imop.types import Observation


@pytest.fixture(scope="module")
def seen() -> Observation:
    world = World(scene_spec())
    world.set_robot(inverse_kinematics(se3.make(np.diag([-1.0, 1, -1]), (0.25, 0.1, 1.1)), Q)[0], 1.0)
    return observe(world).stripped()


def moved(observation: Observation, T: np.ndarray) -> Observation:
    views = {n: replace(v, T_world_camera=T @ v.T_world_camera) for n, v in observation.views.items()}
    return replace(observation, views=views, T_world_gripper=T @ observation.T_world_gripper)


AWAY = se3.make(se3.euler(z=0.5), (0.1, 0.2, -0.75))
BOUNDS = {"lower": (-2.0, -2.0, -1.0), "upper": (2.0, 2.0, 2.0)}


def test_a_filter_at_the_wrong_base_says_that_it_removes_nothing(seen):
    there = moved(seen, AWAY)
    wrong = panda_self_filter(se3.make(p=(3.0, 3.0, 0.0))).is_robot
    with pytest.warns(SelfFilterWarning, match="front"):
        Perception(wrong, **BOUNDS).points(there)


def test_a_filter_at_the_right_base_removes_the_same_points_anywhere(seen):
    here = panda_self_filter().is_robot
    there = panda_self_filter(AWAY @ T_WORLD_BASE).is_robot
    points = np.random.default_rng(0).uniform((-0.5, -0.4, 0.7), (0.6, 0.4, 1.7), (20_000, 3))
    expected = here(points, Q, 1.0)
    assert 100 < expected.sum() < len(points) / 2
    assert np.mean(there(se3.apply(AWAY, points), Q, 1.0) == expected) > 0.9999
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Perception(there, **BOUNDS).points(moved(seen, AWAY))


def test_a_hand_that_nobody_sees_is_no_reason_to_warn(seen):
    wrist = replace(seen, views={"front": seen.views["front"]}, T_world_gripper=se3.make(p=(0.4, 0.3, 1.2)))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Perception(lambda p, q, opening: np.zeros(len(p), bool)).points(wrist)


def test_an_empty_workspace_names_its_bounds(seen):
    with pytest.raises(InvalidInput, match=r"lower.*upper.*\[workspace\]"):
        Perception(lower=(5, 5, 5), upper=(6, 6, 6)).points(seen)


def test_mounted_parts_move_with_the_hand():
    T = se3.make(p=(0.1, 0.0, -0.05))
    plain = panda_self_filter()
    mounted = plain.with_mounted([box(np.array([0.04, 0.06, 0.02]), 0.002)], T[None], tip_pose)
    for q in (Q, Q + 0.3):
        inside, outside = se3.apply(tip_pose(q) @ T, np.array([(0.021, 0.031, 0.011), (0.021, 0.034, 0.0)]))
        points = np.stack([inside, outside])
        assert mounted.is_robot(points, q).tolist() == [True, False]
        assert not plain.is_robot(points, q).any()
