"""The scene every task starts from, and the simulated world that is built from it.

World frame as RLBench's: z up, floor at z = 0, table top at z = 0.75, the arm's base on the table.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import mujoco
import numpy as np

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.robots.panda import FINGER_STROKE
from imop.sim.arms import PANDA, Arm
from imop.sim.pictures import MeshPicture, find_pictures
from imop.sim.robot import FINGER_JOINTS
from imop.types import FloatArray, IntArray, as_pose

TABLE_HEIGHT = 0.75
TABLE_LOWER = (-0.5, -0.55)
TABLE_UPPER = (1.1, 0.55)
ROBOT = "robot/"
GRASP = "grasp:"
"""Welds of this prefix, each followed by the body's name, say what the gripper may attach."""
ATTACH_VOLUME = f"{ROBOT}attach_volume"
TIME_STEP = 0.002
CONTACT_SOLREF = (0.004, 1.0)
DEFAULT_SOLREF = (0.02, 1.0)


def _box(body: Any, lower: tuple[float, ...], upper: tuple[float, ...], rgb: tuple[int, ...]) -> None:
    low, high = np.asarray(lower), np.asarray(upper)
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=(low + high) / 2,
        size=(high - low) / 2,
        rgba=[*(c / 255 for c in rgb), 1.0],
    )


def scene_spec(arm: Arm = PANDA) -> Any:
    """Floor, wall, table and an arm (prefix "robot/"): a `mujoco.MjSpec` to add a task's objects to."""
    spec = mujoco.MjSpec()
    spec.modelname = "imop"
    spec.option.timestep = TIME_STEP
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.impratio = 10.0
    world = spec.worldbody
    floor = world.add_body(name="floor")
    floor.add_geom(
        type=mujoco.mjtGeom.mjGEOM_PLANE, size=[5, 5, 0.1], rgba=[220 / 255, 214 / 255, 204 / 255, 1]
    )
    _box(world.add_body(name="wall"), (-2.56, -5, 0), (-2.51, 5, 4), (0, 41, 47))
    table, wood = world.add_body(name="table"), (204, 166, 90)
    _box(table, (*TABLE_LOWER, TABLE_HEIGHT - 0.04), (*TABLE_UPPER, TABLE_HEIGHT), wood)
    for x in (TABLE_LOWER[0] + 0.05, TABLE_UPPER[0] - 0.1):
        for y in (TABLE_LOWER[1] + 0.05, TABLE_UPPER[1] - 0.1):
            _box(table, (x, y, 0), (x + 0.05, y + 0.05, TABLE_HEIGHT - 0.04), wood)
    world.add_light(pos=[0.5, 0, 3], dir=[0, 0, -1], castshadow=False)
    base = world.add_frame(pos=arm.T_world_base[:3, 3], quat=se3.to_wxyz(arm.T_world_base))
    spec.attach(arm.spec(), prefix=ROBOT, frame=base)
    _add_attach_volume(spec)
    return spec


def _add_attach_volume(spec: Any) -> None:
    """An invisible box between the open fingers, RLBench's attach sensor without what lies outside them."""
    hand, tip = spec.body(f"{ROBOT}hand"), spec.site(f"{ROBOT}tip")
    T_hand_tip = se3.make(se3.from_wxyz(tip.quat), tip.pos)
    hand.add_geom(
        name=ATTACH_VOLUME,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=(T_hand_tip @ (0, 0, -0.0235, 1))[:3],
        quat=tip.quat,
        size=[0.01, FINGER_STROKE, 0.0225],
        rgba=[0, 0, 0, 0],
        group=5,
        contype=0,
        conaffinity=0,
        mass=0,
    )


def allow_grasp(spec: Any, body: str) -> None:
    """Declare in `spec` that the gripper attaches `body` when it closes on it."""
    add_weld(spec, f"{GRASP}{body}", f"{ROBOT}hand", body, active=False)


def add_weld(spec: Any, name: str, holder: str, body: str, active: bool = True) -> None:
    """Let `holder` carry `body` as they stand in `spec` while the weld `name` is active."""
    weld = spec.add_equality(name=name, type=mujoco.mjtEq.mjEQ_WELD)
    weld.objtype = mujoco.mjtObj.mjOBJ_BODY
    weld.name1, weld.name2 = holder, body
    weld.active = active
    weld.solref = CONTACT_SOLREF


@dataclass(frozen=True, eq=False)
class WorldState:
    """Everything that `World.restore_state` needs to continue identically."""

    physics: FloatArray
    grasps: FloatArray
    body_positions: FloatArray
    body_quaternions: FloatArray


class World:
    """A compiled scene and its state. The arm starts at its home with the gripper open.

    Args:
        spec: of the scene, from `scene_spec`.
        arm: the one that the scene has.

    Attributes:
        arm: the arm in the scene.
        model: the compiled MjModel.
        data: its MjData.
        instances: (bodies,) int32, the instance each body belongs to: what moves rigidly together is one
            instance (id of its uppermost body), the whole robot is one, and 0 is nothing.
        instance_names: instance id -> name.
        graspable: names of the bodies that the gripper may attach.
        unavoided: numbers of the bodies that motion planning does not care about; none unless a task says so.
        light_color: (3,) red, green, blue, 0 .. 1, of the lamps as cameras see them; white.
    """

    def __init__(self, spec: Any, arm: Arm = PANDA):
        self.arm = arm
        self.model: Any = spec.compile()
        self.data: Any = mujoco.MjData(self.model)
        # Contacts of MuJoCo's default softness let fingers sink centimetres into what they hold.
        soft = np.all(self.model.geom_solref == DEFAULT_SOLREF, axis=1)
        self.model.geom_solref[soft] = CONTACT_SOLREF
        body_names = [self.model.body(i).name for i in range(self.model.nbody)]
        self.instances: IntArray = np.where(
            self.model.body_weldid > 0, self.model.body_weldid, self.model.body_rootid
        ).astype(np.int32)
        robot = np.array([name.startswith(ROBOT) for name in body_names])
        self.robot_bodies = frozenset(int(i) for i in np.flatnonzero(robot))
        self.instances[robot] = np.flatnonzero(robot)[0]
        self.instance_names = {int(i): body_names[i] for i in np.unique(self.instances) if i > 0}
        self.instance_names[int(np.flatnonzero(robot)[0])] = ROBOT.rstrip("/")
        names = [self.model.equality(i).name for i in range(self.model.neq)]
        self.graspable = tuple(name.removeprefix(GRASP) for name in names if name.startswith(GRASP))
        self.unavoided: frozenset[int] = frozenset()
        self.light_color: FloatArray = np.ones(3)
        self.arm_qpos, self.arm_dof, self.arm_ctrl = self._addresses(arm.joints)
        self.finger_qpos, self.finger_dof, self.finger_ctrl = self._addresses(FINGER_JOINTS)
        self._tip = self.model.site(f"{ROBOT}tip").id
        self.set_robot(arm.home, 1.0)

    def _addresses(self, joints: tuple[str, ...]) -> tuple[IntArray, IntArray, IntArray]:
        """Where positions, velocities and targets of the robot's joints stand."""
        found = [self.model.joint(ROBOT + name) for name in joints]
        actuators = [self.model.actuator(ROBOT + name).id for name in joints]
        return (
            np.array([joint.qposadr[0] for joint in found]),
            np.array([joint.dofadr[0] for joint in found]),
            np.array(actuators),
        )

    @cached_property
    def pictures(self) -> dict[int, MeshPicture]:
        """Geometry number -> the picture on it, for those that have one."""
        return find_pictures(self.model)

    def set_robot(self, q: FloatArray, opening: float) -> None:
        """Put the arm at rest at `q` (J,) with the gripper at `opening` (0 closed .. 1 open)."""
        self.data.qpos[self.arm_qpos] = self.data.ctrl[self.arm_ctrl] = q
        self.data.qpos[self.finger_qpos] = self.data.ctrl[self.finger_ctrl] = opening * FINGER_STROKE
        self.data.qvel[self.arm_dof] = 0
        self.data.qvel[self.finger_dof] = 0
        self.forward()

    def step(self, n: int = 1) -> None:
        """Advance the physics by `n` time steps."""
        mujoco.mj_step(self.model, self.data, nstep=n)

    def forward(self) -> None:
        """Recompute poses and contacts after the state was written."""
        mujoco.mj_forward(self.model, self.data)

    @property
    def time(self) -> float:
        """Simulated seconds."""
        return float(self.data.time)

    def pose(self, body: str) -> FloatArray:
        """T_world_body (4, 4)."""
        found = self.data.body(body)
        return se3.make(found.xmat.reshape(3, 3), found.xpos)

    def set_free_pose(self, body: str, T_world_body: FloatArray) -> None:
        """Put a body of the uppermost level, free or fixed to the world, at a pose and at rest.

        Raises:
            InvalidInput: if `body` is held by another joint or by another body.
        """
        T = as_pose("T_world_body", T_world_body)
        found = self.model.body(body)
        joints, first = int(found.jntnum[0]), int(found.jntadr[0])
        if joints == 1 and self.model.jnt_type[first] == mujoco.mjtJoint.mjJNT_FREE:
            start, dof = int(self.model.jnt_qposadr[first]), int(self.model.jnt_dofadr[first])
            self.data.qpos[start : start + 7] = (*T[:3, 3], *se3.to_wxyz(T))
            self.data.qvel[dof : dof + 6] = 0
        elif joints == 0 and int(found.parentid[0]) == 0:
            found.pos, found.quat = T[:3, 3], se3.to_wxyz(T)
        else:
            raise InvalidInput(
                "body", f"{body} has a parent", "a body with a free joint, or fixed in the world"
            )
        self.forward()

    def joint(self, name: str) -> float:
        """Position of a hinge (radians) or slide (metres)."""
        return float(self.data.qpos[self.model.joint(name).qposadr[0]])

    def set_joint(self, name: str, position: float) -> None:
        """Put a hinge (radians) or slide (metres) at `position`, at rest."""
        joint = self.model.joint(name)
        self.data.qpos[joint.qposadr[0]] = position
        self.data.qvel[joint.dofadr[0]] = 0
        self.forward()

    @property
    def T_world_gripper(self) -> FloatArray:
        """Pose of the tip (4, 4)."""
        return se3.make(self.data.site_xmat[self._tip].reshape(3, 3), self.data.site_xpos[self._tip])

    @property
    def gripper_opening(self) -> float:
        """0 closed .. 1 open, mean of the two fingers."""
        return float(np.clip(self.data.qpos[self.finger_qpos].mean() / FINGER_STROKE, 0.0, 1.0))

    @property
    def robot_q(self) -> FloatArray:
        """Joint positions of the arm (J,) radians; the Panda's in Franka's convention."""
        return np.array(self.data.qpos[self.arm_qpos])

    @property
    def robot_dq(self) -> FloatArray:
        """Joint velocities of the arm (J,) radians per second."""
        return np.array(self.data.qvel[self.arm_dof])

    @property
    def held(self) -> tuple[str, ...]:
        """Names of the bodies that are attached to the hand."""
        return tuple(b for b in self.graspable if self.data.eq_active[self.model.equality(GRASP + b).id])

    def save_state(self) -> WorldState:
        """The complete state; a restored world continues bit for bit the same."""
        kind = mujoco.mjtState.mjSTATE_INTEGRATION
        physics = np.empty(mujoco.mj_stateSize(self.model, kind))
        mujoco.mj_getState(self.model, self.data, physics, kind)
        m = self.model
        return WorldState(physics, m.eq_data.copy(), m.body_pos.copy(), m.body_quat.copy())

    def restore_state(self, state: WorldState) -> None:
        """Return to a state saved from this world or from one of the same spec."""
        self.model.eq_data[:] = state.grasps
        self.model.body_pos[:], self.model.body_quat[:] = state.body_positions, state.body_quaternions
        mujoco.mj_setState(self.model, self.data, state.physics, mujoco.mjtState.mjSTATE_INTEGRATION)
        self.forward()
        # The forward pass overwrote the solver's warm start, which is part of the state.
        mujoco.mj_setState(self.model, self.data, state.physics, mujoco.mjtState.mjSTATE_INTEGRATION)
