"""A scripted expert on the simulator, recorded as a real arm and real cameras would be."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from imop.cameras.interfaces import Frame
from imop.errors import InvalidInput
from imop.extras import extra
from imop.geometry import se3
from imop.recording.draft import Draft
from imop.recording.recorder import DemonstrationRecorder
from imop.robots.interfaces import RobotState
from imop.setup.setup import CameraSetup, RobotSetup, Setup, WorkspaceSetup
from imop.types import Demonstration, FloatArray

with extra("sim"):
    from imop.sim.arms import Arm, find_arm
    from imop.sim.cameras import CAMERAS, Camera, camera_view
    from imop.sim.depth_noise import DepthNoise
    from imop.sim.motion import WORKSPACE_LOWER, WORKSPACE_UPPER
    from imop.sim.sensing import calibration_error
    from imop.sim.world import TABLE_HEIGHT, World
    from imop.tasks.env import make_task
    from imop.tasks.expert import perform
    from imop.tasks.task import Task, make_scene

BEFORE, AFTER = 0.4, 0.6
"""Simulated seconds in which the arm stands before and after what it does."""


@dataclass(frozen=True)
class Noise:
    """What sensors add; all zeros add nothing.

    Attributes:
        joints: standard deviation of the measured joint positions, radians.
        opening: of the measured opening, fraction of the stroke.
        depth: of the cameras.
        calibration: how far cameras are from where the set-up has them, metres and radians.
    """

    joints: float = 2e-4
    opening: float = 0.005
    depth: DepthNoise = field(default_factory=DepthNoise.of_d415)
    calibration: tuple[float, float] = (0.0, 0.0)


CLEAN = Noise(0.0, 0.0, DepthNoise())


def record_expert(
    folder: Path,
    task: str,
    *,
    robot: str = "panda",
    seed: int = 0,
    variation: int = 0,
    instance: int = 0,
    rate: float = 15.0,
    cameras: Mapping[str, Camera] = CAMERAS,
    size: tuple[int, int] = (128, 128),
    noise: Noise | None = None,
) -> tuple[Draft, Demonstration]:
    """Record the expert while it does a task once; what was interrupted is continued.

    Args:
        folder: of the recording.
        task: "suite/name".
        robot: one of `robots.ARMS`.
        seed: of the scene, and of the noise.
        variation: of the task.
        instance: seed of the things' shapes, sizes and colours.
        rate: frames per simulated second.
        cameras: by name.
        size: width and height of their images, pixels.
        noise: that of an ordinary arm with D415 cameras if None.

    Returns:
        The recording with its keyframes, and the expert's own demonstration, with steps that nobody had to
        find and views of RLBench's cameras without noise.

    Raises:
        ExpertFailed: if it did not reach its aim; what it did is in the folder, as a failure of a person.
        NoRoom: if there is no such scene.
        InvalidInput: for an unknown task, arm or variation, and as `DemonstrationRecorder.start`.
        MissingExtra: without the simulator, or the arm's model.
    """
    if not 1 <= rate <= 500:
        raise InvalidInput("rate", f"{rate:g}", "1 to 500 frames per second")
    made, arm = make_task(task), find_arm(robot)
    words = made.instructions(variation)
    world = make_scene(made, variation, instance, seed, arm=arm)
    cell = SimulatedCell(world, arm, cameras, size, Noise() if noise is None else noise, seed)
    origin = {"robot": robot, "seed": seed, "variation": variation, "instance": instance, "rate": rate}
    recorder = DemonstrationRecorder.start(
        folder,
        cell.setup,
        task=task,
        instructions=words,
        kind="scripted",
        origin={"simulated": task, **origin},
    )
    with recorder:
        expert = _play(made, world, rate, lambda number: _add(recorder, cell, number))
    return recorder.stop(), expert


class SimulatedCell:
    """A simulated world as sensors tell of it, and the set-up that a calibration would have written.

    Args:
        world: looked at.
        arm: that stands in it.
        cameras: where they truly are.
        size: of the images, width and height.
        noise: of all sensors.
        seed: of the noise.
    """

    def __init__(
        self,
        world: World,
        arm: Arm,
        cameras: Mapping[str, Camera],
        size: tuple[int, int],
        noise: Noise,
        seed: int,
    ):
        self._world, self._arm, self._cameras = world, arm, dict(cameras)
        self._size, self._noise, self._seed = size, noise, seed
        off = np.random.default_rng((seed, 0))
        told = {name: calibration_error(off, *noise.calibration) for name in cameras}
        self.setup = _setup(arm, {name: (camera, told[name]) for name, camera in cameras.items()}, size)

    def measure(self, number: int) -> tuple[dict[str, Frame], RobotState]:
        """What is seen and measured now; the noise depends on the number of the frame alone."""
        rng, world = np.random.default_rng((self._seed, 1, number)), self._world
        q = world.robot_q + rng.normal(0, self._noise.joints, len(world.robot_q))
        opening = float(np.clip(world.gripper_opening + rng.normal(0, self._noise.opening), 0, 1))
        T_base_gripper = se3.invert(self._arm.T_world_base) @ self._arm.kinematics.tip_pose(q)
        frames = {}
        for name, camera in self._cameras.items():
            view = self._noise.depth.view(camera_view(world, camera, *self._size), rng)
            frames[name] = Frame(view.rgb, view.depth, view.intrinsics, world.time)
        return frames, RobotState(T_base_gripper, opening, q, world.time)


def _add(recorder: DemonstrationRecorder, cell: SimulatedCell, number: int) -> None:
    if number >= recorder.count:
        recorder.add(*cell.measure(number))


def _play(task: Task, world: World, rate: float, look: Callable[[int], None]) -> Demonstration:
    """Let the expert do the task; `look` is called with 0, 1, ... at the rate."""
    _watch(world, rate, look)
    world.step(round(BEFORE / world.model.opt.timestep))
    expert = perform(task, world)
    world.step(round(AFTER / world.model.opt.timestep))
    return expert


def _watch(world: World, rate: float, look: Callable[[int], None]) -> None:
    """Have `look` called in simulated time, whoever advances the physics."""
    step, began, number = world.step, world.time, 0

    def stepped(n: int = 1) -> None:
        nonlocal number
        while n > 0:
            ahead = int(np.ceil((began + number / rate - world.time) / world.model.opt.timestep - 1e-6))
            if ahead <= 0:
                look(number)
                number += 1
                continue
            step(min(ahead, n))
            n -= min(ahead, n)

    setattr(world, "step", stepped)  # noqa: B010 (a method of this one world)


def _setup(arm: Arm, cameras: Mapping[str, tuple[Camera, FloatArray]], size: tuple[int, int]) -> Setup:
    known = {}
    for name, (camera, T_camera_told) in cameras.items():
        T, K = camera.T_mount_camera @ T_camera_told, camera.intrinsics(*size)
        places = (None, T) if camera.on_gripper else (T, None)
        known[name] = CameraSetup(K, size, *places)
    # What the gripper may reach begins above the table, what is seen below it.
    lower = WORKSPACE_LOWER - (0.0, 0.0, 0.05)
    workspace = WorkspaceSetup(lower, WORKSPACE_UPPER, TABLE_HEIGHT)
    return Setup(RobotSetup(arm.name, arm.home, arm.T_world_base), workspace, known)
