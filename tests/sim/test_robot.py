import frankik
import mujoco
import numpy as np
import pytest

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.sim.robot import (
    FINGER_STROKE,
    JOINT_LOWER,
    JOINT_UPPER,
    PANDA_HOME_Q,
    T_WORLD_BASE,
    panda_spec,
    tip_pose,
)


@pytest.fixture(scope="module")
def model():
    return panda_spec().compile()


def random_q(rng):
    return rng.uniform(JOINT_LOWER, JOINT_UPPER)


def test_forward_kinematics_agrees_with_frankik(rng, model):
    data = mujoco.MjData(model)
    # frankik's forward kinematics gives the hand's tool centre, and its offset is rounded: that of its answer for
    # one configuration takes the place of the documented one.
    kinematics = frankik.FrankaKinematics(frankik.RobotType.PANDA)
    tool = se3.invert(T_WORLD_BASE @ kinematics.forward(PANDA_HOME_Q)) @ tip_pose(PANDA_HOME_Q)
    np.testing.assert_allclose(tool[:3, 3], (0, 0, 0.1099 - 0.1034), atol=2.1e-3)
    for _ in range(50):
        q = rng.uniform(JOINT_LOWER, JOINT_UPPER)
        np.testing.assert_allclose(tip_pose(q), T_WORLD_BASE @ kinematics.forward(q) @ tool, atol=1e-6)
        data.qpos[:7] = q
        mujoco.mj_kinematics(model, data)
        site = data.site("tip")
        found = T_WORLD_BASE @ se3.make(site.xmat.reshape(3, 3), site.xpos)
        np.testing.assert_allclose(found, tip_pose(q), atol=1e-6)


def test_the_home_pose_is_that_of_rlbench():
    T = tip_pose(PANDA_HOME_Q)
    np.testing.assert_allclose(T[:3, 3], (0.2785, -0.0082, 1.4720), atol=2e-3)
    np.testing.assert_allclose(T[:3, 2], (0.240, 0, -0.971), atol=5e-3)


def test_it_stands_still_against_gravity(model):
    data = mujoco.MjData(model)
    data.qpos[:7], data.qpos[7:] = PANDA_HOME_Q, FINGER_STROKE
    data.ctrl[:7], data.ctrl[7:] = PANDA_HOME_Q, FINGER_STROKE
    mujoco.mj_step(model, data, nstep=500)
    np.testing.assert_allclose(data.qpos[:7], PANDA_HOME_Q, atol=1e-3)
    assert data.ncon == 0


@pytest.mark.parametrize("opening", [0.0, 0.5, 1.0])
def test_fingers_are_mirrored_about_the_tip(model, opening):
    data = mujoco.MjData(model)
    data.qpos[7:] = opening * FINGER_STROKE
    mujoco.mj_kinematics(model, data)
    site = data.site("tip")
    T = se3.make(site.xmat.reshape(3, 3), site.xpos)
    first, second = (
        se3.apply(se3.invert(T), data.body(name).xpos[None])[0] for name in ("left_finger", "right_finger")
    )
    np.testing.assert_allclose(first[[0, 2]], second[[0, 2]], atol=1e-9)
    assert first[1] == pytest.approx(-second[1], abs=1e-9)
    joint = model.joint("finger_joint1")
    moved = data.xpos[joint.bodyid[0]] if hasattr(joint, "bodyid") else data.body("left_finger").xpos
    assert (opening == 0) or se3.apply(se3.invert(T), moved[None])[0, 1] < 0


def test_limits_are_those_of_the_model(model):
    np.testing.assert_allclose(model.jnt_range[:7], np.stack([JOINT_LOWER, JOINT_UPPER], axis=1))
    np.testing.assert_allclose(model.jnt_range[7:], [[0, FINGER_STROKE]] * 2)


@pytest.mark.parametrize("q", [np.zeros(6), np.zeros((7, 1)), "home"])
def test_bad_joints_are_named(q):
    with pytest.raises(InvalidInput):
        tip_pose(q)
