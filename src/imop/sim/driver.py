"""The simulated arm and cameras behind the interfaces of real ones."""

import threading

import numpy as np

from imop.cameras.interfaces import Frame
from imop.errors import InvalidInput, PlanFailed
from imop.geometry import se3
from imop.robots.interfaces import DONE, MotionResult, RobotState
from imop.sim.cameras import CAMERAS, Camera, camera_view
from imop.sim.execute import move, plan_for
from imop.sim.gripper import set_gripper
from imop.sim.world import World
from imop.types import FloatArray, as_pose

IMAGE = (128, 128)
"""Width and height by default, pixels."""
_ARRIVED = (0.005, 0.05)
"""Where a motion ends is at most so far from its goal, metres and radians."""
_SETTLE_STEPS = 100


class _Stopped(Exception):
    """Ends a motion from within."""


class SimulatedRobot:
    """The arm of a simulated world as a `Robot`. A motion takes as long as it takes to simulate.

    Args:
        world: moved by motions.
        lower, upper: (3,) metres, world frame; the gripper is not sent out of these bounds.
        seed: of the motion planner.
    """

    def __init__(
        self,
        world: World,
        lower: FloatArray | None = None,
        upper: FloatArray | None = None,
        seed: int = 0,
    ):
        self.world, self._seed = world, seed
        self._lower = np.full(3, -np.inf) if lower is None else np.asarray(lower)
        self._upper = np.full(3, np.inf) if upper is None else np.asarray(upper)
        self._stop = threading.Event()

    def state(self) -> RobotState:
        """What the arm measures now; the stamp is the simulation's clock."""
        world = self.world
        T_base_gripper = se3.invert(world.arm.T_world_base) @ world.T_world_gripper
        return RobotState(T_base_gripper, world.gripper_opening, world.robot_q, world.time)

    def move_to(
        self, T_base_gripper: FloatArray, *, straight: bool = False, allow_collisions: bool = False
    ) -> MotionResult:
        """As `Robot.move_to`, with the simulation's own planner, which knows all obstacles."""
        T = self.world.arm.T_world_base @ as_pose("T_base_gripper", T_base_gripper)
        if np.any(T[:3, 3] < self._lower) or np.any(T[:3, 3] > self._upper):
            problem = f"{np.round(T[:3, 3], 3).tolist()} m, world frame"
            return MotionResult(False, "outside_workspace", problem)
        self._stop.clear()
        try:
            trajectory = plan_for(self.world, T, allow_collisions, straight, self._seed)
            move(self.world, trajectory, self._watch)
        except PlanFailed as error:
            return MotionResult(False, error.reason, str(error))
        except _Stopped:
            return self._halted()
        if not se3.near(self.world.T_world_gripper, T, *_ARRIVED):
            off = float(se3.translation_distance(self.world.T_world_gripper, T))
            return MotionResult(False, "not_arrived", f"{off * 1000:.0f} mm away")
        return DONE

    def move_gripper(self, opening: float) -> MotionResult:
        """As `Robot.move_gripper`."""
        if not 0.0 <= opening <= 1.0:
            raise InvalidInput("opening", f"{opening}", "a fraction of the stroke, 0 closed .. 1 open")
        self._stop.clear()
        try:
            set_gripper(self.world, opening > 0.5, self._watch, opening)
        except _Stopped:
            return self._halted()
        return DONE

    def stop(self) -> None:
        """As `Robot.stop`."""
        self._stop.set()

    def recover(self) -> MotionResult:
        """Nothing is ever wrong with a simulated arm."""
        return DONE

    def _watch(self, world: World) -> None:
        if self._stop.is_set():
            raise _Stopped

    def _halted(self) -> MotionResult:
        """Hold the arm where it is."""
        world = self.world
        world.data.ctrl[world.arm_ctrl] = world.robot_q
        world.data.ctrl[world.finger_ctrl] = world.data.qpos[world.finger_qpos]
        world.step(_SETTLE_STEPS)
        return MotionResult(False, "stopped", "stop was called")


class SimulatedCamera:
    """A camera that looks at a simulated world.

    Args:
        world: looked at.
        camera: where it stands, and what it sees; a name is that of one of RLBench's cameras.
        size: width and height, pixels.
    """

    def __init__(self, world: World, camera: Camera | str, size: tuple[int, int] = IMAGE):
        self._world, self._size = world, size
        self._camera = CAMERAS[camera] if isinstance(camera, str) else camera

    def capture(self) -> Frame:
        """What is seen now; the stamp is the simulation's clock."""
        view = camera_view(self._world, self._camera, *self._size)
        return Frame(view.rgb, view.depth, view.intrinsics, self._world.time)
