import time

import frankik
import mujoco
import numpy as np
import pytest
from benchmarks.self_filter import measure
from hypothesis import given
from hypothesis import strategies as st

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.geometry.self_filter import SelfFilter
from imop.robots import panda
from imop.sim import robot
from imop.sim.mjcf_filter import mjcf_self_filter

JOINTS = st.tuples(
    *(st.floats(lo, hi) for lo, hi in zip(panda.JOINT_LOWER, panda.JOINT_UPPER, strict=True))
).map(np.array)

# frankik's fk returns Franka's hand frame moved to its tool centre point.
T_FLANGE_FRANKIK_TCP = se3.make(se3.euler(z=-np.pi / 4), (0, 0, 0.1034))


@given(JOINTS)
def test_flange_agrees_with_frankik(q):
    T_base_flange = se3.invert(panda.T_WORLD_BASE) @ panda.link_poses(q)[-1]
    np.testing.assert_allclose(T_base_flange, frankik.fk(q) @ se3.invert(T_FLANGE_FRANKIK_TCP), atol=1e-6)


def test_home_is_rlbench_start():
    """Recorded start of RLBench's episodes (position, quaternion xyzw)."""
    pose = se3.to_pose7(panda.tip_pose(panda.PANDA_HOME_Q))
    np.testing.assert_allclose(pose[:3], (0.2785, -0.0082, 1.4720), atol=0.003)
    np.testing.assert_allclose(pose[3:], (0, 0.9927, 0, 0.1209), atol=0.003)


@pytest.mark.parametrize("q", [[0.0] * 6, [[0.0] * 7]])
def test_wrong_number_of_joints_is_refused(q):
    with pytest.raises(InvalidInput, match="q"):
        panda.tip_pose(q)


@pytest.fixture(scope="module")
def self_filter() -> SelfFilter:
    return panda.panda_self_filter()


def rays_onto_panda(q: np.ndarray, opening: float, rng: np.random.Generator, n: int = 4000) -> np.ndarray:
    """Points in the world where rays from around meet the robot."""
    model = robot.panda_spec().compile()
    data = mujoco.MjData(model)
    data.qpos[:7], data.qpos[7:] = q, opening * panda.FINGER_STROKE
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    eye = rng.normal(size=(n, 3))
    eye = 2 * eye / np.linalg.norm(eye, axis=1, keepdims=True) + (0.2, 0, 0.4)
    target = data.geom_xpos[rng.integers(0, model.ngeom, n)] + rng.normal(scale=0.03, size=(n, 3))
    direction = (target - eye) / np.linalg.norm(target - eye, axis=1, keepdims=True)
    geom = np.zeros(1, dtype=np.int32)
    hits = []
    for p, v in zip(eye, direction, strict=True):
        distance = mujoco.mj_ray(model, data, p, v, None, 1, -1, geom)
        if distance >= 0:
            hits.append(p + distance * v)
    return se3.apply(panda.T_WORLD_BASE, np.array(hits))


def clearances(points: np.ndarray, q: np.ndarray, opening: float) -> np.ndarray:
    """MuJoCo's own distance (N,) from world points to the nearest geom of the robot, up to 0.2 m."""
    spec = robot.panda_spec()
    spec.worldbody.add_body(name="probe", mocap=True).add_geom(name="probe", size=(1e-4, 0, 0))
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[:7], data.qpos[7:] = q, opening * panda.FINGER_STROKE
    probe = model.geom("probe").id
    distances = []
    for p in se3.apply(se3.invert(panda.T_WORLD_BASE), points):
        data.mocap_pos[0] = p
        mujoco.mj_kinematics(model, data)
        each = [
            mujoco.mj_geomDistance(model, data, i, probe, 0.2, None) for i in range(model.ngeom) if i != probe
        ]
        distances.append(min(each))
    return np.array(distances)


def test_knows_the_same_points_as_the_filter_of_the_mujoco_model(self_filter, rng):
    model = robot.panda_spec().compile()
    names = (robot.ARM_JOINTS, robot.FINGER_JOINTS)
    by_mujoco = mjcf_self_filter(model, *names, panda.T_WORLD_BASE, panda.FILTER_MARGIN)
    removed = 0
    for q in rng.uniform(panda.JOINT_LOWER, panda.JOINT_UPPER, (30, 7)):
        opening = rng.uniform()
        near_solid = panda.body_poses(q, opening)[rng.integers(11, size=2000), :3, 3]
        points = near_solid + rng.normal(scale=0.06, size=(2000, 3))
        found = self_filter.is_robot(points, q, opening)
        np.testing.assert_array_equal(found, by_mujoco.is_robot(points, q, opening))
        removed += found.sum()
    assert 10_000 < removed < 50_000


@pytest.mark.parametrize("opening", [0.0, 0.3, 1.0])
def test_removes_the_robots_surface(self_filter, rng, opening):
    q = 0.5 * (rng.uniform(panda.JOINT_LOWER, panda.JOINT_UPPER) + panda.PANDA_HOME_Q)
    surface = rays_onto_panda(q, opening, rng)
    assert len(surface) > 1000
    assert self_filter.is_robot(surface, q, opening).all()


def test_removes_what_is_inside_and_spares_what_is_five_centimetres_away(self_filter, rng):
    q = 0.5 * (rng.uniform(panda.JOINT_LOWER, panda.JOINT_UPPER) + panda.PANDA_HOME_Q)
    points = rays_onto_panda(q, 1.0, rng, 400)
    points = points + rng.normal(scale=0.06, size=points.shape)
    distance, found = clearances(points, q, 1.0), self_filter.is_robot(points, q, 1.0)
    inside, away = distance < 0, distance > 0.05
    assert inside.sum() > 20
    assert away.sum() > 20
    assert found[inside].all()
    assert not found[away].any()


def test_what_the_fingers_hold_survives(self_filter):
    q, opening = panda.PANDA_HOME_Q, 0.25
    half = opening * panda.FINGER_STROKE - 0.002
    p_tip = (
        np.array(np.meshgrid((-0.005, 0, 0.005), np.linspace(-half, half, 5), (-0.012, 0))).reshape(3, -1).T
    )
    held = se3.apply(panda.tip_pose(q), p_tip)
    assert not self_filter.is_robot(held, q, opening).any()
    assert self_filter.is_robot(held, q, 0.0).any()


def test_points_between_open_fingers_are_kept_and_the_fingers_move(self_filter):
    q = panda.PANDA_HOME_Q
    left_finger_open = se3.apply(panda.tip_pose(q), np.array([[0, -0.047, -0.008]]))
    assert self_filter.is_robot(left_finger_open, q, 1.0).all()
    assert not self_filter.is_robot(left_finger_open, q, 0.0).any()


def test_empty_and_unmeasured_points_are_not_robot(self_filter):
    assert self_filter.is_robot(np.empty((0, 3)), panda.PANDA_HOME_Q).shape == (0,)
    assert not self_filter.is_robot(np.full((3, 3), np.nan), panda.PANDA_HOME_Q).any()


@pytest.mark.parametrize(
    ("q", "opening", "field"),
    [
        (np.zeros(6), 1.0, "joint_positions"),
        (np.full(7, np.nan), 1.0, "joint_positions"),
        (np.zeros(7), np.inf, "gripper_opening"),
    ],
)
def test_bad_joints_are_refused(self_filter, q, opening, field):
    with pytest.raises(InvalidInput, match=field):
        self_filter.is_robot(np.zeros((1, 3)), q, opening)


def test_points_of_another_shape_are_refused(self_filter):
    with pytest.raises(InvalidInput, match="points"):
        self_filter.is_robot(np.zeros((3, 2)), panda.PANDA_HOME_Q)


def test_fifty_thousand_points_are_quick(self_filter, rng):
    points = rng.uniform((-0.5, -0.6, 0.7), (0.8, 0.6, 1.7), (50_000, 3))
    times = []
    for _ in range(5):
        start = time.process_time()
        self_filter.is_robot(points, panda.PANDA_HOME_Q)
        times.append(time.process_time() - start)
    assert min(times) < 0.1


def test_real_recordings(self_filter, rlbench_demos):
    """What the project promises (98 %, 1 %), with reserve, and the handle between the fingers."""
    counts = measure(self_filter, rlbench_demos)
    assert counts["robot"].total > 200_000
    assert counts["held"].total > 10_000
    assert min(counts["robot"].fraction, counts["robot_anywhere"].fraction) > 0.99
    assert max(counts["other"].fraction, counts["other_anywhere"].fraction) < 0.005
    assert counts["held"].fraction < 0.05
