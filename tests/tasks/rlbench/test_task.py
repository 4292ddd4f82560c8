"""What RLBench's tasks share, on small models of our own."""

import pytest

from imop.geometry import se3
from imop.tasks.coppelia.placing import place
from imop.tasks.coppelia.reader import read_model
from imop.tasks.expert import perform
from imop.tasks.rlbench.conditions import Detected, JointMoved
from imop.tasks.rlbench.task import RLBenchTask
from imop.tasks.task import make_scene
from tests.tasks.coppelia import writer
from tests.tasks.coppelia.conftest import TABLE, cupboard

DOWN = {"q": (0, 0, 1, 0)}  # w x y z: half a turn about y


def lever(words="", path_words=""):
    """A box on the table, a waypoint above it, a path from there, and one more waypoint."""
    curve = [(0, 0, 0), (0.05, 0, 0), (0.1, 0, 0)]
    return writer.ttm(
        writer.arrays(writer.box_mesh()),
        writer.dummy("base", 1, base=True, p=(0.3, 0, TABLE)),
        writer.shape("box", 2, 1, p=(0.2, 0.2, 0.05)),
        writer.dummy("waypoint0", 3, 1, p=(0, 0, 0.2), extension=words, **DOWN),
        writer.path("waypoint1", 4, 1, curve, p=(0, 0, 0.2), extension=path_words, **DOWN),
        writer.dummy("waypoint2", 5, 1, p=(0, 0, 0.25), **DOWN),
    )


class Small(RLBenchTask):
    """Its model is given, and it stays where the file has it."""

    name = "own/small"
    words = ("do it",)
    placed = False
    content = lever()

    def load(self):
        return read_model(self.content)

    def conditions(self):
        return [Detected("waypoint0", "inside")]


def small(**fields):
    return type("Task", (Small,), fields)()


@pytest.mark.parametrize("path_words", ["", "ignore_collisions", "open_gripper()"])
def test_steps_along_a_path_may_touch_things_whatever_its_words_say(path_words):
    task = small(content=lever(path_words=path_words), _problem=lambda self, world: "")
    steps = task.waypoints(make_scene(task, 0, 0, 0))
    assert [w.allow_collisions for w in steps] == [False, *([True] * (len(steps) - 2)), False]
    assert len(steps) > 2


@pytest.mark.parametrize("amount", [0.25, 0.6])
def test_the_expert_closes_as_far_as_the_words_say_and_stays_so(amount):
    task = small(
        content=lever(f"close_gripper({amount})"),
        _problem=lambda self, world: "",
        conditions=lambda self: [],
    )
    world = make_scene(task, 0, 0, 0)
    demonstration = perform(task, world)
    after = [demonstration.after(k).gripper_opening for k in range(len(demonstration))]
    assert after == pytest.approx([amount] * len(after), abs=0.02)
    assert not any(k.action.gripper_open for k in demonstration.keyframes), "actions are open or closed"


def test_joints_count_from_where_the_episode_put_them():
    task = small(
        content=cupboard(),
        _problem=lambda self, world: "",
        init_episode=lambda self, scene, rng: scene.world.set_joint("slide", 0.0),
        conditions=lambda self: [JointMoved("slide", 0.05)],
    )
    world = make_scene(task, 0, 0, 0)
    assert not task.success(world), "the file has it at 0.1"
    world.set_joint("slide", 0.06)
    assert task.success(world)


def test_conditions_may_name_what_was_drawn_and_a_dummy():
    def init_episode(self, scene, rng):
        self.thing = "waypoint0"

    task = small(
        content=cupboard(),
        _problem=lambda self, world: "",
        init_episode=init_episode,
        conditions=lambda self: [Detected(self.thing, "inside")],
    )
    world = make_scene(task, 0, 0, 0)
    assert not task.success(world)
    T_world_seen = world.pose("inside") @ se3.make(p=(0, 0, 0.04))
    place(world, task.model, task.thing, T_world_seen)
    assert task.success(world)
