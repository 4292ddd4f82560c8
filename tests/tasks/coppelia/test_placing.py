import numpy as np
import pytest

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.tasks.coppelia.boxes import model_box, own_box
from imop.tasks.coppelia.placing import place, recolor
from tests.tasks.coppelia.test_convert import world_of


@pytest.fixture
def world(cupboard_model):
    return world_of(cupboard_model)


def test_everything_below_comes_along(world, cupboard_model):
    names = [o.name for o in cupboard_model.objects]
    T_root = world.pose("cupboard")
    before = {n: se3.invert(T_root) @ world.pose(n) for n in names}
    T_new = se3.make(se3.euler(z=1.0), (0.3, 0.1, 0.9))
    world.data.qvel[:] = 1.0
    place(world, cupboard_model, "cupboard", T_new)
    for n in names:
        assert world.pose(n) == pytest.approx(T_new @ before[n], abs=1e-9)
    assert np.all(world.data.qvel[world.model.joint("ball").dofadr[0] :][:6] == 0)


def test_what_is_above_stays(world, cupboard_model):
    before = {n: world.pose(n) for n in ("cupboard", "frame", "ball")}
    place(world, cupboard_model, "drawer", se3.make(p=(0.1, 0.2, 1.0)))
    assert world.pose("drawer")[:3, 3] == pytest.approx([0.1, 0.2, 1.0])
    for n, T in before.items():
        assert world.pose(n) == pytest.approx(T)


def test_joints_still_work_where_they_were_put(world, cupboard_model):
    place(world, cupboard_model, "cupboard", se3.make(se3.euler(x=np.pi / 2), (0.3, 0.1, 0.9)))
    before = world.pose("drawer")
    world.set_joint("slide", 0.2)
    moved = world.pose("drawer")[:3, 3] - before[:3, 3]
    assert moved == pytest.approx([0, -0.1, 0], abs=1e-6)


def test_a_saved_state_brings_everything_back(world, cupboard_model):
    state, before = world.save_state(), world.pose("waypoint0")
    place(world, cupboard_model, "cupboard", se3.make(p=(0.3, 0.1, 0.9)))
    place(world, cupboard_model, "waypoint0", se3.make(p=(0.0, 0.1, 0.9)))
    world.restore_state(state)
    assert world.pose("waypoint0") == pytest.approx(before)


def test_joints_and_strangers_are_not_placed(world, cupboard_model):
    for name in ("slide", "nobody"):
        with pytest.raises(InvalidInput):
            place(world, cupboard_model, name, np.eye(4))


def test_a_shape_changes_colour_and_its_children_do_not(world):
    m = world.model
    recolor(world, "frame", (0.0, 0.5, 1.0))
    own = m.geom_bodyid == m.body("frame").id
    assert m.geom_rgba[own, :3] == pytest.approx(np.array([[0, 0.5, 1.0]]), abs=2e-3)
    assert m.geom_rgba[m.geom_bodyid == m.body("drawer").id, :3] == pytest.approx(np.array([[1.0, 0, 0]]))


def test_boxes_of_models_hold_all_that_is_below(world, cupboard_model):
    low, high = model_box(world, cupboard_model, "cupboard")
    for name in ("frame", "drawer", "ball", "waypoint0", "area"):
        p = se3.apply(se3.invert(world.pose("cupboard")), world.pose(name)[None, :3, 3])[0]
        assert np.all(p >= low - 1e-9) and np.all(p <= high + 1e-9)
    # The boundary is 0.4 wide; the ball at (0.2, -0.3) in the root's frame is 0.1 wide.
    assert low == pytest.approx([-0.25, -0.35, -0.005])
    assert high[0] == pytest.approx(0.25)


def test_boxes_are_those_of_now(world, cupboard_model):
    place(world, cupboard_model, "ball", se3.make(p=(0.25, 1.0, 0.8)))
    assert model_box(world, cupboard_model, "cupboard")[1][1] == pytest.approx(1.05)


def test_what_is_no_model_has_its_own_box(world, cupboard_model):
    low, high = model_box(world, cupboard_model, "frame")
    assert high == pytest.approx([0.05] * 3) and low == pytest.approx([-0.05] * 3)
    assert own_box(cupboard_model["waypoint0"])[1] == pytest.approx([0.005] * 3)
