from dataclasses import dataclass, replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from imop.sim.world import World, allow_grasp, scene_spec
from imop.tasks.coppelia.convert import add_model
from imop.tasks.coppelia.reader import read_model
from imop.tasks.rlbench.conditions import (
    AllOf,
    AnyOf,
    Detected,
    DetectedSeveral,
    Grasped,
    InOrder,
    JointMoved,
    NothingGrasped,
)
from imop.tasks.rlbench.scene import Scene
from tests.tasks.coppelia.conftest import cupboard


@dataclass
class Fixed:
    """Met as told."""

    now: bool

    def met(self, scene):
        return self.now


def test_a_sensor_sees_what_is_in_it_and_negated_what_is_not(scene):
    seen, unseen = Detected("ball", "inside"), Detected("ball", "inside", negated=True)
    assert not seen.met(scene) and unseen.met(scene)
    scene.move_to("ball", "inside")
    assert seen.met(scene) and not unseen.met(scene)


def test_several_are_counted_once_each(scene):
    scene.move_to("ball", "inside")
    scene.move("frame", (1.0, 1.0, 1.0))
    scene.move("ball", scene.pose("inside")[:3, 3])
    for count, met in ((0, True), (1, True), (2, False)):
        assert DetectedSeveral(("ball", "area"), ("inside", "inside"), count).met(scene) == met


@pytest.mark.parametrize("begun", [0.1, 0.2])
@pytest.mark.parametrize("by", [0.05, -0.05])
def test_a_joint_moves_either_way_from_where_the_episode_began(scene, begun, by):
    scene.world.set_joint("slide", begun)
    scene = replace(scene, begun=scene.joints())
    condition = JointMoved("slide", 0.04)
    assert not condition.met(scene)
    scene.world.set_joint("slide", begun + by)
    assert condition.met(scene)
    assert not JointMoved("slide", 0.06).met(scene)


def test_what_is_attached_is_grasped():
    model, spec = read_model(cupboard()), scene_spec()
    add_model(spec, model)
    allow_grasp(spec, "ball")
    scene = Scene(World(spec), model)
    assert NothingGrasped().met(scene) and not Grasped("ball").met(scene)
    scene.world.data.eq_active[scene.world.model.equality("grasp:ball").id] = 1
    assert Grasped("ball").met(scene) and not NothingGrasped().met(scene)


@given(st.lists(st.booleans(), max_size=4))
def test_any_and_all(states):
    conditions = [Fixed(state) for state in states]
    assert AnyOf(conditions).met(None) == any(states)
    assert AllOf(conditions).met(None) == all(states)


@given(st.lists(st.lists(st.booleans(), min_size=3, max_size=3), max_size=8))
def test_order_is_remembered_and_events_before_their_turn_do_not_count(history):
    parts = [Fixed(False) for _ in range(3)]
    ordered, reached = InOrder(parts), 0
    for states in history:
        for part, state in zip(parts, states, strict=True):
            part.now = state
        while reached < 3 and states[reached]:
            reached += 1
        assert ordered.met(None) == (reached == 3)
