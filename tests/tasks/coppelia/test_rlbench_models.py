"""All real model files, where they are: they read, convert, stand still, and agree with the notes on them."""

import numpy as np
import pytest

from imop.geometry import se3
from imop.tasks.coppelia.boxes import model_box
from imop.tasks.coppelia.model import Joint, Shape
from imop.tasks.coppelia.parts import filled
from imop.tasks.coppelia.placing import place
from imop.tasks.coppelia.reader import read_file
from imop.tasks.rlbench.edits import hollow
from tests.conftest import SHARED
from tests.tasks.coppelia.test_convert import world_of

NOT_CONVEX = {"place_shape_in_shape_sorter": ["shape_sorter_visual"]}
_FILES = sorted((SHARED / "data" / "rlbench_ttm").glob("*.ttm"))
TASKS = [path.stem for path in _FILES if path.stem != "robot_panda"] or ["open_drawer"]
FALLING = {"beat_the_buzz": 0.05, "remove_cups": 0.04, "sweep_to_dustpan_of_size": 0.03}
"""Models in which something hangs loose or starts in the air, with the metres that it may move."""
# Lowest and highest x, then y, of the model's box in its own frame, by the notes on the tasks.
BOXES = {
    "open_drawer": (-0.191, 0.191, -0.189, 0.440),
    "lamp_on": (-0.137, 0.167, -0.183, 0.310),
    "straighten_rope": (-0.177, 0.005, -0.323, 0.184),
    "beat_the_buzz": (-0.137, 0.095, -0.176, 0.176),
    "close_laptop_lid": (-0.294, 0.186, -0.271, 0.100),
    "stack_cups": (-0.208, 0.192, -0.301, 0.299),
}


def test_all_files_are_there(rlbench_models):
    assert len(list(rlbench_models.glob("*.ttm"))) == 37  # 36 tasks and the arm


@pytest.mark.parametrize("task", TASKS)
def test_models_read_convert_and_stand_still(rlbench_models, task):
    model = read_file(rlbench_models / f"{task}.ttm")
    root = model.objects[0]
    assert root.name == task and root.model_base
    apart = filled(model)
    assert apart == NOT_CONVEX.get(task, [])
    for name in apart:  # it takes minutes, and the task leaves these out as well
        model = hollow(model, name)
    world = world_of(model, "rlbench/")
    names = [o.name for o in model.objects if isinstance(o, Shape | Joint)]
    before = {n: world.pose("rlbench/" + n)[:3, 3] for n in names}
    world.step(500)
    moved = {n: np.linalg.norm(world.pose("rlbench/" + n)[:3, 3] - p) for n, p in before.items()}
    assert max(moved.values()) < FALLING.get(task, 0.02), max(moved, key=moved.get)


def test_the_tip_of_the_arm(rlbench_models):
    model = read_file(rlbench_models / "robot_panda.ttm")
    assert model.T_world("Panda_tip")[:3, 3] == pytest.approx([0.278, -0.008, 1.473], abs=1e-3)
    limits = [model[f"Panda_joint{i}"].limits for i in range(1, 8)]
    assert limits[3] == pytest.approx((-3.0718, -0.0698), abs=1e-4)
    assert limits[5] == pytest.approx((-0.0175, 3.7525), abs=1e-4)


@pytest.mark.parametrize("task", BOXES)
def test_boxes_of_models(rlbench_models, task):
    model = read_file(rlbench_models / f"{task}.ttm")
    low, high = model_box(world_of(model), model, task)
    assert (low[0], high[0], low[1], high[1]) == pytest.approx(BOXES[task], abs=6e-4)


def test_waypoints_and_joints_of_open_drawer(rlbench_models):
    model = read_file(rlbench_models / "open_drawer.ttm")
    T_root = model.T_world("open_drawer")
    assert T_root[:3, 3] == pytest.approx([0.25, 0, 0.752], abs=1e-4)
    T = se3.invert(T_root) @ model.T_world("waypoint1")
    assert T[:3, 3] == pytest.approx([0, 0.196, 0.163], abs=1e-3)
    assert T[:3, 2] == pytest.approx([0, -1, 0], abs=1e-3)
    assert model["waypoint2"].extension.replace(" ", "") == "ignore_collisions;linear"
    assert model["drawer_joint_top"].limits == pytest.approx((0, 0.3))
    world = world_of(model)
    before = world.pose("drawer_top")
    place(world, model, "open_drawer", T_root @ se3.make(se3.euler(z=np.pi / 2)))
    world.set_joint("drawer_joint_top", 0.2)
    opened = world.pose("drawer_top")[:3, 3] - T_root[:3, 3]
    closed = before[:3, 3] - T_root[:3, 3]
    assert opened == pytest.approx([-closed[1] - 0.2, closed[0], closed[2]], abs=1e-3)
