import mujoco
import numpy as np
import pytest
from benchmarks.self_filter import measure

from imop.errors import InvalidInput
from imop.geometry import primitives, se3
from imop.geometry.self_filter import SelfFilter
from imop.sim.robot import PANDA_HOME_Q, T_WORLD_BASE, panda_self_filter, panda_spec, tip_pose

XML = """
<mujoco>
  <asset><mesh name="wedge" vertex="0 0 0  .1 0 0  0 .1 0  0 0 .1"/></asset>
  <worldbody>
    <body name="table"><geom type="box" size="1 1 .1" pos="0 0 -1"/></body>
    <body name="base">
      <geom type="box" size=".1 .05 .02"/>
      <body name="arm" pos="0 0 .5">
        <joint name="turn" axis="0 0 1" range="-3 3"/>
        <geom type="capsule" fromto="0 0 0 .4 0 0" size=".03"/>
        <geom type="sphere" size=".05" pos=".5 0 0"/>
        <geom type="ellipsoid" size=".05 .03 .02" pos=".6 0 0"/>
        <geom type="cylinder" size=".04 .1" pos=".7 0 0"/>
        <geom type="mesh" mesh="wedge" pos=".8 0 0"/>
        <body name="finger" pos=".95 0 0">
          <joint name="slide" type="slide" axis="0 1 0" range="0 .04"/>
          <geom type="box" size=".01 .01 .02"/>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


@pytest.fixture(scope="module")
def panda():
    return panda_self_filter()


def surface_of_panda(rng, q, opening, count=4000):
    """Points on the outside of the arm: rays from all around that end on it."""
    model = panda_spec().compile()
    data = mujoco.MjData(model)
    data.qpos[:7], data.qpos[7:] = q, 0.04 * opening
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    points = []
    geom = np.zeros(1, dtype=np.int32)
    for _ in range(count):
        target = data.geom_xpos[rng.integers(model.ngeom)] + rng.normal(0, 0.03, 3)
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        start = target - 3 * direction
        distance = mujoco.mj_ray(model, data, start, direction, None, 1, -1, geom, None)
        if distance > 0:
            points.append(start + distance * direction)
    return se3.apply(T_WORLD_BASE, np.array(points))


@pytest.mark.parametrize("opening", [0.0, 1.0])
def test_the_whole_surface_is_robot_and_what_is_5_cm_off_is_not(panda, rng, opening):
    q = PANDA_HOME_Q + rng.uniform(-0.4, 0.4, 7)
    surface = surface_of_panda(rng, q, opening)
    assert len(surface) > 1000
    assert panda.is_robot(surface, q, opening).all()
    lower, upper = surface.min(axis=0) - 0.05, surface.max(axis=0) + 0.05
    outside = rng.uniform(lower - 0.2, upper + 0.2, (5000, 3))
    outside = outside[np.any((outside < lower) | (outside > upper), axis=1)]
    assert len(outside) > 1000 and not panda.is_robot(outside, q, opening).any()


def test_what_is_held_between_the_fingers_stays(panda):
    T = tip_pose(PANDA_HOME_Q)
    bar = np.linspace(-0.04, 0.04, 50)[:, None] * T[:3, 0] + T[:3, 3] - 0.008 * T[:3, 2]
    assert not panda.is_robot(bar, PANDA_HOME_Q, 0.2).any()


def test_it_follows_the_base(rng):
    q = PANDA_HOME_Q
    T = se3.make(se3.euler(z=0.7), (1.0, 2.0, 0.1))
    names = [f"joint{i}" for i in range(1, 8)], ["finger_joint1", "finger_joint2"]
    model = panda_spec().compile()
    here = SelfFilter(model, *names, margin=0.01)
    there = SelfFilter(model, *names, T_world_model=T, margin=0.01)
    points = rng.uniform(-0.5, 1.0, (3000, 3))
    np.testing.assert_array_equal(here.is_robot(points, q), there.is_robot(se3.apply(T, points), q))


def test_any_model_with_named_joints(rng):
    model = mujoco.MjModel.from_xml_string(XML)
    here = SelfFilter(model, ["turn"], ["slide"], margin=0.0)
    R = se3.euler(z=0.5)
    inside = [[0.2, 0, 0], [0.5, 0.04, 0], [0.64, 0, 0], [0.7, 0, 0.09], [0.82, 0.02, 0.02], [0.95, 0.04, 0]]
    outside = [[0.2, 0, 0.04], [0.5, 0, 0.06], [0.6, 0, 0.03], [0.7, 0, 0.11], [0.95, 0, 0]]
    world = [np.array(points) @ R.T + (0, 0, 0.5) for points in (inside, outside)]
    assert here.is_robot(world[0], np.array([0.5]), 1.0).all()
    assert not here.is_robot(world[1], np.array([0.5]), 1.0).any()
    # The table is another tree.
    assert not here.is_robot(np.array([[0, 0, -1.0]]), np.array([0.5])).any()
    above = np.array([[0.2, 0, 0.54]])
    assert not here.is_robot(above, np.array([0.0])).any()
    assert SelfFilter(model, ["turn"], ["slide"], margin=0.02).is_robot(above, np.array([0.0])).all()


def test_points_that_are_not_finite_are_not_robot(panda):
    points = np.array([[np.nan, 0, 0], [np.inf, 0, 0]])
    assert not panda.is_robot(points, PANDA_HOME_Q).any()


@pytest.mark.parametrize(
    ("call", "field"),
    [
        (lambda f: f.is_robot(np.zeros((3, 3)), np.zeros(6)), "joint_positions"),
        (lambda f: f.is_robot(np.zeros((3, 3)), np.full(7, np.nan)), "joint_positions"),
        (lambda f: f.is_robot(np.zeros((3, 3)), PANDA_HOME_Q, np.nan), "gripper_opening"),
        (lambda f: f.is_robot(np.zeros((3, 2)), PANDA_HOME_Q), "points"),
        (lambda f: SelfFilter(panda_spec().compile(), ["elbow"]), "joint_names"),
        (lambda f: SelfFilter(panda_spec().compile(), []), "joint_names"),
        (lambda f: SelfFilter(panda_spec().compile(), ["joint1"], margin={"nose": 0.1}), "margin"),
    ],
)
def test_bad_input_is_named(panda, call, field):
    with pytest.raises(InvalidInput, match=field):
        call(panda)


@pytest.mark.parametrize("name", ["sphere", "capsule", "cylinder", "box", "ellipsoid"])
def test_distances_agree_with_rays(name, rng):
    """Outside, the distance is never longer than that along any ray; inside and outside are told apart."""
    size = {"sphere": [0.1], "capsule": [0.05, 0.1], "cylinder": [0.05, 0.1]}.get(name, [0.1, 0.06, 0.03])
    spec = mujoco.MjSpec()
    geom = spec.worldbody.add_geom(type=getattr(mujoco.mjtGeom, f"mjGEOM_{name.upper()}"))
    geom.size = [*size, 0, 0][:3]
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    distance = getattr(primitives, name)
    found = np.zeros(1, dtype=np.int32)
    for _ in range(200):
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        start = rng.uniform(-0.02, 0.02, 3) - direction
        length = mujoco.mj_ray(model, data, start, direction, None, 1, -1, found, None)
        here = distance(start[None], model.geom_size[0])[0]
        if length < 0:
            assert here > 0
            continue
        assert 0 < here <= length + 1e-6
        surface = start + length * direction
        probes = np.stack([surface, surface + 1e-4 * direction, surface - 1e-4 * direction])
        on, inside, outside = distance(probes, model.geom_size[0])
        assert abs(on) < 1e-6 and inside < 0 < outside


def test_on_real_recordings_the_robot_goes_and_the_rest_stays(rlbench_demos):
    found = measure(rlbench_demos)
    assert found["robot_points"] > 100_000 and found["held_points"] > 10_000
    assert found["robot_removed"] >= 0.98
    assert found["other_removed"] <= 0.01
    assert found["held_removed"] <= 0.10
