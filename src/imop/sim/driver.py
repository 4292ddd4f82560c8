"""The simulated arm and cameras behind the interfaces of real ones."""

import threading
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from imop.cameras.interfaces import Frame
from imop.errors import PlanFailed
from imop.geometry import se3
from imop.robots.interfaces import DONE, MotionResult, RobotState
from imop.robots.limits import Limits
from imop.sim.arms import Arm
from imop.sim.cameras import CAMERAS, Camera, camera_view
from imop.sim.execute import move, plan_for
from imop.sim.gripper import OnFrame, set_gripper
from imop.sim.motion import Trajectory
from imop.sim.world import World
from imop.types import FloatArray, as_fraction, as_pose

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
        limits: how fast it may be; by default as fast as its joints can.
        on_frame: called with the world every 0.05 simulated seconds of motion.
        seed: of the motion planner.
    """

    def __init__(
        self, world: World, limits: Limits | None = None, on_frame: OnFrame | None = None, seed: int = 0
    ):
        self.world, self._limits, self._on_frame, self._seed = world, limits, on_frame, seed
        self._stop = threading.Event()
        # What was measured last of an arm that moves: the world changes in the thread that moves it.
        self._seen: RobotState | None = None
        self._looking = threading.Lock()

    def state(self) -> RobotState:
        """What the arm measures now; the stamp is the simulation's clock."""
        with self._looking:
            return self._seen or self._measured()

    def move_to(
        self, T_base_gripper: FloatArray, *, straight: bool = False, allow_collisions: bool = False
    ) -> MotionResult:
        """As `Robot.move_to`, with the simulation's own planner, which knows all obstacles."""
        T = self.world.arm.T_world_base @ as_pose("T_base_gripper", T_base_gripper)

        def go() -> MotionResult:
            trajectory = plan_for(self.world, T, allow_collisions, straight, self._seed)
            if self._limits is not None:
                trajectory = slowed(trajectory, self.world.arm, self._limits)
            move(self.world, trajectory, self._watch)
            if se3.near(self.world.T_world_gripper, T, *_ARRIVED):
                return DONE
            off = f"{se3.translation_distance(self.world.T_world_gripper, T) * 1000:.0f} mm away"
            # What may touch things may be stopped by them: a drawer is open, a button is pressed.
            touched = MotionResult(True, detail=f"stopped by what it touches, {off}")
            return touched if allow_collisions else MotionResult(False, "not_arrived", off)

        return self._moved(go)

    def move_gripper(self, opening: float) -> MotionResult:
        """As `Robot.move_gripper`."""
        wanted = as_fraction("opening", opening)

        def go() -> MotionResult:
            set_gripper(self.world, wanted > 0.5, self._watch, wanted)
            return DONE

        return self._moved(go)

    def stop(self) -> None:
        """As `Robot.stop`."""
        self._stop.set()

    def recover(self) -> MotionResult:
        """Nothing is ever wrong with a simulated arm."""
        return DONE

    def _moved(self, go: Callable[[], MotionResult]) -> MotionResult:
        self._stop.clear()
        with self._looking:
            self._seen = self._measured()
        try:
            return go()
        except PlanFailed as error:
            return MotionResult(False, error.reason, str(error))
        except _Stopped:
            return self._halted()
        finally:
            with self._looking:
                self._seen = None

    def _measured(self) -> RobotState:
        world = self.world
        T_base_gripper = se3.invert(world.arm.T_world_base) @ world.T_world_gripper
        return RobotState(T_base_gripper, world.gripper_opening, world.robot_q, world.time)

    def _watch(self, world: World) -> None:
        self._seen = self._measured()
        if self._on_frame is not None:
            self._on_frame(world)
        if self._stop.is_set():
            raise _Stopped

    def _halted(self) -> MotionResult:
        """Hold the arm where it is."""
        world = self.world
        world.data.ctrl[world.arm_ctrl] = world.robot_q
        world.data.ctrl[world.finger_ctrl] = world.data.qpos[world.finger_qpos]
        world.step(_SETTLE_STEPS)
        return MotionResult(False, "stopped", "stop was called")


def slowed(trajectory: Trajectory, arm: Arm, limits: Limits) -> Trajectory:
    """The same way in more time, if it is too fast."""
    poses = np.stack([arm.kinematics.tip_pose(q) for q in trajectory.positions])
    seconds = np.diff(trajectory.times)
    speed = se3.translation_distance(poses[:-1], poses[1:]) / seconds
    turn = se3.rotation_distance(poses[:-1], poses[1:]) / seconds
    fastest = speed.max() / limits.speed, turn.max() / limits.turn
    factor = max(1.0, *fastest, np.abs(trajectory.velocities).max() / limits.joint_speed)
    return replace(trajectory, times=trajectory.times * factor, velocities=trajectory.velocities / factor)


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
