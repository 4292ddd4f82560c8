"""Every task of the suite: its scenes are fit to start from, its aim is what the expert reaches."""

import functools

import numpy as np
import pytest

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.tasks.check_task import check_task
from imop.tasks.env import ImopEnv, make_task, to_array
from imop.tasks.expert import record_demonstration
from imop.tasks.tabletop import REAL, TABLETOP
from imop.tasks.task import make_scene
from imop.types import Action

SEEDS = (0, 1)
INSTANCE = 5

# Those of the split real have quicker tests of their own.
every_task = pytest.mark.parametrize("name", [name for name in TABLETOP if name not in REAL])


@functools.cache
def demonstration(name):
    return record_demonstration(make_task(name), 1_000, instance_seed=INSTANCE)


@every_task
def test_the_checker_finds_nothing(name):
    assert check_task(name) == []


@every_task
def test_instances_differ_in_shape_or_colour(name):
    task = make_task(name)
    a, b = (make_scene(task, 0, instance, 0).model for instance in (0, 1))
    mine = [i for i in range(a.ngeom) if "clutter" not in a.body(a.geom_bodyid[i]).name]
    assert a.ngeom != b.ngeom or not np.allclose(a.geom_size[mine], b.geom_size[mine])


@every_task
def test_carried_by_the_true_object_pose_a_demonstration_succeeds_elsewhere_and_replayed_it_fails(name):
    demo = demonstration(name)
    outcomes = {"oracle": 0.0, "replay": 0.0}
    for seed in SEEDS:
        for method in outcomes:
            env = ImopEnv(make_task(name))
            env.reset(seed=seed, options={"instance_seed": INSTANCE})
            for keyframe in demo.keyframes:
                T = keyframe.action.T_world_gripper
                if method == "oracle":
                    T = env.world.pose(keyframe.object_name) @ se3.invert(keyframe.T_world_object) @ T
                open_, free = keyframe.action.gripper_open, keyframe.action.allow_collisions
                _, reward, terminated, _, _ = env.step(to_array(Action(T, open_, free)))
                if terminated:
                    break
            outcomes[method] += reward
    assert outcomes["oracle"] == 2
    assert outcomes["replay"] == 0


@every_task
def test_an_unknown_variation_is_named(name):
    task = make_task(name)
    with pytest.raises(InvalidInput, match="variation"):
        make_scene(task, task.variations, 0, 0)
