import mujoco
import numpy as np
import pytest
from hypothesis import strategies as st

from imop.geometry import se3
from imop.robots import panda
from imop.sim import robot

JOINTS = st.tuples(
    *(st.floats(lo, hi) for lo, hi in zip(panda.JOINT_LOWER, panda.JOINT_UPPER, strict=True))
).map(np.array)

# frankik's fk returns Franka's hand frame moved to its tool centre point.
T_FLANGE_FRANKIK_TCP = se3.make(se3.euler(z=-np.pi / 4), (0, 0, 0.1034))


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return robot.panda_spec().compile()


def tip_of(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    site = data.site("tip")
    return panda.T_WORLD_BASE @ se3.make(site.xmat.reshape(3, 3), site.xpos)


def simulate(model: mujoco.MjModel, data: mujoco.MjData, seconds: float) -> None:
    for _ in range(round(seconds / model.opt.timestep)):
        mujoco.mj_step(model, data)


@pytest.fixture
def home(model: mujoco.MjModel) -> mujoco.MjData:
    data = mujoco.MjData(model)
    data.qpos[:7] = data.ctrl[:7] = panda.PANDA_HOME_Q
    data.qpos[7:] = data.ctrl[7:] = panda.FINGER_STROKE
    mujoco.mj_forward(model, data)
    return data


def test_model_agrees_with_closed_form(model, rng):
    data = mujoco.MjData(model)
    for q in rng.uniform(panda.JOINT_LOWER, panda.JOINT_UPPER, (50, 7)):
        data.qpos[:7] = q
        mujoco.mj_kinematics(model, data)
        np.testing.assert_allclose(tip_of(model, data), panda.tip_pose(q), atol=1e-6)


def test_names_and_limits_are_frankas(model):
    for i, name in enumerate(robot.ARM_JOINTS):
        np.testing.assert_allclose(model.joint(name).range, (panda.JOINT_LOWER[i], panda.JOINT_UPPER[i]))
        np.testing.assert_allclose(model.actuator(name).ctrlrange, model.joint(name).range)
        np.testing.assert_allclose(model.actuator(name).forcerange[1], panda.JOINT_TORQUE[i])
    for name in robot.FINGER_JOINTS:
        np.testing.assert_allclose(model.joint(name).range, (0, 0.04))
    bodies = {model.body(i).name for i in range(model.nbody)}
    assert bodies >= {*(f"link{i}" for i in range(8)), "hand", "left_finger", "right_finger"}


def test_stands_still_at_home(model, home):
    simulate(model, home, 2.0)
    assert np.abs(home.qpos[:7] - panda.PANDA_HOME_Q).max() < 1e-4
    assert home.ncon == 0


def test_follows_its_targets(model, home):
    target = panda.PANDA_HOME_Q + np.array([0.2, 0.1, -0.2, -0.3, 0.2, 0.2, 0.3])
    home.ctrl[:7] = target
    simulate(model, home, 3.0)
    assert np.abs(home.qpos[:7] - target).max() < 2e-3


def test_fingers_close_and_open_together_on_their_sides(model, home):
    for target in (0.0, panda.FINGER_STROKE):
        home.ctrl[7:] = target
        simulate(model, home, 0.5)
        np.testing.assert_allclose(home.qpos[7:9], target, atol=5e-4)
    tip = home.site("tip")
    left, right = (
        (home.body(name).xpos - tip.xpos) @ tip.xmat.reshape(3, 3) for name in ("left_finger", "right_finger")
    )
    np.testing.assert_allclose((left[1], right[1]), (-0.04, 0.04), atol=1e-3)


def test_finger_ends_and_faces_meet_the_tip(model, home):
    """At the tip's height the fingers end, and when closed their faces meet there."""
    home.qpos[7:] = 0
    mujoco.mj_kinematics(model, home)
    tip = home.site("tip")
    ends, faces = [], []
    for name in ("left_finger_3", "right_finger_3"):
        geom = home.geom(name)
        R = tip.xmat.reshape(3, 3).T @ geom.xmat.reshape(3, 3)
        centre = tip.xmat.reshape(3, 3).T @ (geom.xpos - tip.xpos)
        extent = np.abs(R) @ model.geom(name).size
        ends.append(centre[2] + extent[2])
        faces.append(abs(centre[1]) - extent[1])
    np.testing.assert_allclose(ends, 0, atol=2e-3)
    np.testing.assert_allclose(faces, 0, atol=5e-4)


def test_hand_spans_what_rlbenchs_does(model, home):
    """Extent in the tip frame: x +-0.032, y -0.100 .. 0.104, z -0.138 .. -0.046."""
    tip, lower, upper = home.site("tip"), [], []
    for i in range(model.ngeom):
        if model.body(model.geom_bodyid[i]).name == "hand":
            R = tip.xmat.reshape(3, 3).T @ home.geom_xmat[i].reshape(3, 3)
            centre = tip.xmat.reshape(3, 3).T @ (home.geom_xpos[i] - tip.xpos)
            half = model.geom_aabb[i, 3:]
            lower.append(centre - np.abs(R) @ half)
            upper.append(centre + np.abs(R) @ half)
    np.testing.assert_allclose(np.min(lower, axis=0), (-0.032, -0.100, -0.138), atol=0.005)
    np.testing.assert_allclose(np.max(upper, axis=0), (0.032, 0.104, -0.046), atol=0.005)


def test_mass_is_the_identified_one_and_gravity_compensated(model):
    assert model.body_mass.sum() == pytest.approx(17.5, abs=1.0)
    assert (model.body_gravcomp[1:] == 1).all()
