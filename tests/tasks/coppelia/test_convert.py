import mujoco
import numpy as np
import pytest

from imop.errors import InvalidInput
from imop.sim.world import World, scene_spec
from imop.tasks.coppelia import dynamics
from imop.tasks.coppelia.convert import add_model
from imop.tasks.coppelia.masses import mass_and_moments
from imop.tasks.coppelia.reader import read_model
from tests.tasks.coppelia import writer


def world_of(model, prefix=""):
    spec = scene_spec()
    add_model(spec, model, prefix)
    return World(spec)


def test_every_object_is_a_body_where_the_file_has_it(cupboard_model):
    world = world_of(cupboard_model)
    for i, o in enumerate(cupboard_model.objects):
        assert world.pose(o.name) == pytest.approx(cupboard_model.T_world_moved[i], abs=1e-9)
    assert world.model.site("waypoint0").bodyid == world.model.body("waypoint0").id


def test_dynamic_shapes_are_free_unless_a_joint_holds_them(cupboard_model):
    model = world_of(cupboard_model).model
    assert model.jnt_type[model.body("ball").jntadr[0]] == mujoco.mjtJoint.mjJNT_FREE
    assert model.body("ball").parentid == 0
    assert model.body("drawer").jntnum == 0
    slide = model.joint("slide")
    assert slide.type == mujoco.mjtJoint.mjJNT_SLIDE
    assert slide.range == pytest.approx([0, 0.3])
    assert slide.qpos0 == pytest.approx(0.1)


def test_joints_move_what_hangs_on_them_from_where_the_file_has_it(cupboard_model):
    world = world_of(cupboard_model)
    before = world.pose("waypoint0")[2, 3]
    world.set_joint("slide", 0.25)
    assert world.pose("waypoint0")[2, 3] == pytest.approx(before + 0.15)


def test_areas_are_drawn_and_felt_by_nobody(cupboard_model):
    model = world_of(cupboard_model).model
    assert model.body("area").geomnum == 0
    assert model.body("frame").geomnum == 1


def test_names_must_be_new(cupboard_model):
    spec = scene_spec()
    add_model(spec, cupboard_model)
    with pytest.raises(InvalidInput, match="cupboard"):
        add_model(spec, cupboard_model)
    add_model(spec, cupboard_model, "second/")
    assert World(spec).pose("second/frame").shape == (4, 4)


def build(*items):
    return read_model(writer.ttm(writer.arrays(writer.box_mesh()), *items))


def hinged(q=0.0, **options):
    return build(
        writer.shape("base", 1),
        writer.joint("j", 2, 1, kind=10, q=q, low=-1, extent=2, **options),
        writer.shape("flap", 3, 2, dynamic=True, p=(0.1, 0, 0)),
    )


def test_a_motor_told_to_stand_still_is_friction_of_its_force():
    assert world_of(hinged(flags=0x10, force=2.5)).model.dof_frictionloss.max() == pytest.approx(2.5)
    model = world_of(hinged(flags=0x00, force=2.5)).model
    assert model.dof_frictionloss[model.joint("j").dofadr[0]] == 0


def test_a_spring_pushes_back_and_holds_its_load():
    model = build(
        writer.shape("base", 1, p=(0, 0, 2)),
        writer.joint("j", 2, 1, kind=11, q=0.1, flags=0xB0, force=250, spring=(250, 6)),
        writer.shape("plate", 3, 2, dynamic=True),
    )
    world = world_of(model)
    world.step(250)
    assert world.joint("j") == pytest.approx(0.1, abs=1e-4)
    world.set_joint("j", 0.05)
    world.step(500)
    assert world.joint("j") == pytest.approx(0.1, abs=1e-3)


def test_limits_hold_in_radians():
    world = world_of(hinged(q=0.5))
    world.data.qvel[world.model.joint("j").dofadr[0]] = 20
    world.step(200)
    assert world.joint("j") < 1.05
    assert world.model.joint("j").range == pytest.approx([-1, 1])


def test_a_joint_with_a_static_shape_stays():
    model = build(writer.joint("j", 1, -1, kind=10, q=0.7), writer.shape("door", 2, 1))
    assert not dynamics.is_moving_joint(model, model.index["j"])
    world = world_of(model)
    assert world.model.body("j").jntnum == 0
    assert world.pose("door")[:3, :3] == pytest.approx(model.T_world_moved[1][:3, :3])


def test_shapes_on_both_sides_of_a_joint_pass_through_each_other():
    assert dynamics.passing_pairs(hinged()) == [("base", "flap")]


@pytest.mark.parametrize(("masks", "passing"), [((0xFF0F, 0xFFF0), True), ((0xFF0F, 0xFFFF), False)])
def test_masks_within_a_tree(masks, passing):
    model = build(
        writer.shape("base", 1),
        writer.shape("a", 2, 1, dynamic=True, mask=masks[0]),
        writer.shape("b", 3, 1, dynamic=True, mask=masks[1]),
    )
    assert (("a", "b") in dynamics.passing_pairs(model)) is passing


def test_masks_between_trees():
    one, two = (writer.shape(n, i, dynamic=True, mask=m) for n, i, m in (("a", 1, 0x0F00), ("b", 2, 0xF0FF)))
    assert dynamics.passing_pairs(build(one, two)) == [("a", "b")]


def test_static_shapes_ride_on_what_they_hang_on():
    model = build(
        writer.shape("box", 1, dynamic=True, p=(0.3, 0, 1.5)), writer.shape("badge", 2, 1, respondable=False)
    )
    world = world_of(model)
    world.step(100)
    assert world.pose("badge") == pytest.approx(world.pose("box"))
    assert world.pose("box")[2, 3] < 1.45


@pytest.mark.parametrize("mass", [1e-7, 0.5, 1e4])
def test_masses_and_moments_stay_possible(mass):
    geometry = writer.item(
        "Gst", writer.leaf().replace(writer.wrapper(), writer.wrapper(mass, (1e-9, 1e-9, 1e-9)))
    )
    m, moments = mass_and_moments(build(writer.shape("s", 1, -1, geometry, dynamic=True))["s"])
    box = m / 12 * 2 * 0.1**2
    assert 0.0199 < m < 8.001
    assert np.all(moments >= 0.49 * box) and moments.max() <= moments.sum() - moments.max()


def test_a_screw_or_ball_joint_converts():
    model = build(
        writer.shape("a", 1, dynamic=True, p=(0.3, 0, 1)),
        writer.joint("j", 2, 1, kind=12),
        writer.shape("b", 3, 2, dynamic=True, p=(0.2, 0, 0)),
    )
    world = world_of(model)
    assert world.model.joint("j").type == mujoco.mjtJoint.mjJNT_BALL


def test_meshes_with_triangles_of_no_area_convert():
    v, t = writer.box_mesh()
    t = np.concatenate([t, [[0, 0, 1], [2, 2, 2]]])
    mesh = writer.item("Gst", writer.leaf(primitive=0))
    items = (writer.shape("s", 1, -1, mesh, p=(0, 0, 1)),)
    world = world_of(read_model(writer.ttm(writer.arrays((v, t)), *items)))
    # One geometry to see and one to feel, as tall as the file's.
    assert world.model.body("s").geomnum == 2


def test_flat_meshes_have_a_hull():
    flat = (np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]]), [[0, 1, 2]])
    mesh = writer.item("Gst", writer.leaf(primitive=0))
    world = world_of(read_model(writer.ttm(writer.arrays(flat), writer.shape("s", 1, -1, mesh))))
    assert world.model.body("s").geomnum == 2


def test_light_things_on_joints_do_not_whirl():
    geometry = writer.item("Gst", writer.leaf(primitive=3, size=(0.002, 0.002, 0.002)))
    model = build(
        writer.shape("base", 1, p=(0, 0, 2)),
        writer.joint("j", 2, 1, kind=10, flags=1),
        writer.shape("crank", 3, 2, geometry, dynamic=True),
    )
    world = world_of(model)
    world.data.qfrc_applied[world.model.joint("j").dofadr[0]] = 0.01
    world.step(500)
    assert 0 < abs(world.data.joint("j").qvel[0]) < 20
