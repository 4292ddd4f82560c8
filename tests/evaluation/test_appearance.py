import mujoco
import numpy as np
import pytest

from imop.evaluation.appearance import FINE_TURNS, Appearance
from imop.geometry import se3
from imop.sim.parts.cup import CupShape, cup
from imop.sim.parts.faucet import FaucetShape, faucet
from imop.sim.parts.shapes import add_to, box, part
from imop.sim.parts.solids import block, trinket
from imop.sim.world import World, scene_spec

RED, BLUE, GREEN = (0.9, 0.1, 0.1), (0.1, 0.1, 0.9), (0.1, 0.7, 0.1)


def two_colored():
    """A cube whose one side has another colour."""
    spec, body = part()
    box(body, (-0.02, -0.02, -0.04), (0.019, 0.02, 0), RED, 500)
    box(body, (0.019, -0.02, -0.04), (0.02, 0.02, 0), BLUE, 500)
    return spec


def ellipsoid():
    spec, body = part()
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_ELLIPSOID, size=[0.03, 0.02, 0.02], rgba=[*RED, 1])
    return spec


@pytest.fixture(scope="module")
def appearance():
    spec = scene_spec()
    parts = {
        "cube": block((0.04, 0.04, 0.04), RED),
        "same_cube": block((0.04, 0.04, 0.04), RED),
        "blue_cube": block((0.04, 0.04, 0.04), BLUE),
        "larger_cube": block((0.05, 0.05, 0.05), RED),
        "block": block((0.06, 0.04, 0.03), RED),
        "can": trinket("can", 0.03, 0.08, GREEN),
        "ball": trinket("ball", 0.03, 0.0, GREEN),
        "bowl": trinket("bowl", 0.04, 0.03, GREEN),
        "cup": cup(CupShape(radius=0.04, height=0.08, taper=0.9, reach=0.03), RED),
        "faucet": faucet(FaucetShape(0.1, 0.1, 0.08, 0.008, 0.12), RED, BLUE),
        "two_colored": two_colored(),
        "ellipsoid": ellipsoid(),
    }
    for name, spec_of_part in parts.items():
        add_to(spec, name, spec_of_part)
    return Appearance(World(spec))


@pytest.mark.parametrize(
    ("name", "turns"),
    [
        ("cube/body", 4),
        ("block/body", 2),
        ("ellipsoid/body", 2),
        ("can/body", FINE_TURNS),
        ("ball/body", FINE_TURNS),
        ("bowl/body", FINE_TURNS),
        ("cup/body", 1),
        ("two_colored/body", 1),
        # A lever alone could be turned, but not on its faucet.
        ("faucet/left", 1),
    ],
)
def test_turns_that_cannot_be_seen(appearance, name, turns):
    found = appearance.turns(name)
    assert len(found) == turns
    assert np.array_equal(found[0], np.eye(4))
    assert np.allclose(found[:, 2, 2], 1) and np.allclose(found[:, :3, 3], 0)


def test_the_upright_axis_counts_whatever_its_name():
    spec = scene_spec()
    body = spec.worldbody.add_body(name="pot", pos=[0.3, 0, 0.8], quat=[0.5**0.5, 0, 0.5**0.5, 0])
    quat = [0.5**0.5, 0, 0.5**0.5, 0]
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=[0.04, 0.05, 0], quat=quat, rgba=[*RED, 1])
    turns = Appearance(World(spec)).turns("pot")
    assert len(turns) == FINE_TURNS and np.allclose(turns[:, 0, 0], 1)


def test_the_frame_need_not_lie_on_the_axis():
    spec = scene_spec()
    tilted = [np.cos(0.06), 0, np.sin(0.06), 0]
    body = spec.worldbody.add_body(name="pot", pos=[0.3, 0, 0.8], quat=tilted)
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=[0.04, 0.05, 0],
        pos=se3.euler(y=-0.12) @ (0.02, 0.01, 0.03),
        quat=[tilted[0], 0, -tilted[2], 0],
        rgba=[*RED, 1],
    )
    turns = Appearance(World(spec)).turns("pot")
    assert len(turns) == FINE_TURNS
    T_world_pot = se3.make(se3.euler(y=0.12), (0.3, 0, 0.8))
    turned = T_world_pot @ turns @ se3.invert(T_world_pot)
    axis = np.array([0.32, 0.01, 0.8, 1.0])
    assert np.allclose(turned @ axis, axis, atol=0.001)
    assert np.allclose(turned[:, 2, 2], 1)


def test_objects_are_alike_in_shape_and_color(appearance):
    assert appearance.alike("cube/body", "same_cube/body")
    for other in ("blue_cube/body", "larger_cube/body", "block/body", "can/body"):
        assert not appearance.alike("cube/body", other)
        assert not appearance.alike(other, "cube/body")


def test_what_hangs_on_the_same_unseen_base_is_judged_alone():
    spec = scene_spec()
    base = spec.worldbody.add_body(name="base")
    for name, x in (("pot", 0.3), ("cube", 0.5)):
        body = base.add_body(name=name, pos=[x, 0, 0.8])
        kind = mujoco.mjtGeom.mjGEOM_CYLINDER if name == "pot" else mujoco.mjtGeom.mjGEOM_BOX
        body.add_geom(type=kind, size=[0.04, 0.04, 0.04], rgba=[*RED, 1])
    world = World(spec)
    assert len(Appearance(world).turns("pot")) == 1
    for name in ("pot", "cube"):
        number = world.model.body(name).id
        world.instances[number], world.instance_names[number] = number, name
    assert len(Appearance(world).turns("pot")) == FINE_TURNS
    assert len(Appearance(world).turns("cube")) == 4
    assert Appearance(world).instance("pot") == "pot"


def test_a_body_that_cannot_be_seen_resembles_nothing(appearance):
    assert not appearance.alike("world", "cube/body")
    assert len(appearance.turns("world")) == 1


def test_bodies_belong_to_the_instances_that_cameras_see(appearance):
    assert appearance.instance("faucet/left") == "faucet/left"
    assert appearance.instance("cube/body") == "cube/body"
