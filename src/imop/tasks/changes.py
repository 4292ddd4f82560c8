"""What a test scene may differ in from the demonstrated one, after The Colosseum, and errors of the sensors.

The demonstration stays as it is; only what belongs to the set-up is the same in both.
"""

import zlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.sim.cameras import CAMERAS, TWO_CAMERAS, VISIBLE_GROUPS, Camera
from imop.sim.depth_noise import DepthNoise
from imop.sim.sensing import Sensing, calibration_error
from imop.sim.world import World
from imop.tasks.distractors import add_distractors, place_distractors
from imop.tasks.task import Task
from imop.types import FloatArray

FACTORS: dict[str, str] = {
    "object_color": "The things acted on have other colours in the test than in the demonstration.",
    "object_size": "All things of the task are larger or smaller in the test, by one factor.",
    "light": "The lamps are darker and coloured in the test.",
    "table_color": "The table has another colour in the test.",
    "distractors": "One or two further things stand on the table in the test.",
    "camera_pose": "Fixed cameras hang up to 0.1 m and 0.05 rad an axis elsewhere in the test, as they say.",
    "d415": "Depth is as noisy as that of a RealSense D415, in demonstration and test.",
    "calibration": "Every camera is 3 mm and 0.5 degrees from where it says, in demonstration and test.",
    "knocked": "Every camera is moved by 3 mm and 0.5 degrees before the test, without saying so.",
    "two_cameras": "Two cameras of 640 x 480 pixels beside the table are all, in demonstration and test.",
    "fewer_cameras": "The camera right_shoulder is missing, in demonstration and test.",
}
"""What may be changed -> what that means."""

SCENE = ("object_color", "object_size", "light", "table_color", "distractors", "camera_pose")
"""What `all` stands for."""

_DISTANCE, _ANGLE = 0.003, np.radians(0.5)
_LEFT_OUT = "right_shoulder"
_SHIFT, _TURN = 0.1, 0.05
_ROOM = ("", "table", "floor", "wall", "robot")
"""Instances that are no things of a task."""


def read_factors(text: str) -> tuple[str, ...]:
    """The factors of a list that is joined by commas, in the order of `FACTORS`; none if it is empty.

    Raises:
        InvalidInput: for an unknown one.
    """
    named = {name.strip() for name in text.split(",")} - {""}
    if unknown := sorted(named - FACTORS.keys() - {"all"}):
        raise InvalidInput(
            "change", ", ".join(unknown), f"any of {', '.join(FACTORS)}, all, joined by commas"
        )
    if "all" in named:
        named |= {*SCENE}
    return tuple(name for name in FACTORS if name in named)


def factors_of(task: type[Task]) -> tuple[str, ...]:
    """What can sensibly be changed in a task."""
    lacks = {"object_color"} if task.told_by_color else set()
    if task.sizes is None:
        lacks.add("object_size")
    return tuple(name for name in FACTORS if name not in lacks)


def changes_of(tasks: Mapping[str, type[Task]], text: str) -> dict[str, tuple[str, ...]]:
    """For every task, by its name, those factors of a list that it has.

    Raises:
        InvalidInput: for an unknown factor, or if none of the tasks has any of those that are named.
    """
    wanted = read_factors(text)
    found = {name: tuple(f for f in factors_of(task) if f in wanted) for name, task in tasks.items()}
    if wanted and not any(found.values()):
        there = dict.fromkeys(factor for task in tasks.values() for factor in factors_of(task))
        raise InvalidInput("change", f"{text} of {', '.join(tasks)}", f"any of {', '.join(there)}")
    return found


@dataclass(frozen=True)
class Change:
    """What is changed in one scene, drawn from its seeds; a `SceneChange`.

    Attributes:
        factors: names of `FACTORS`.
        setup: numbers of the set-up, which demonstration and test have in common.
        seed: of the test scene.
    """

    factors: tuple[str, ...]
    setup: tuple[int, ...]
    seed: int

    @classmethod
    def of(cls, factors: str, task: str, variation: int, instance: int, seed: int) -> "Change":
        """The change of a scene: every task, variation and instance is a set-up of its own."""
        return cls(read_factors(factors), (zlib.crc32(task.encode()), variation, instance), seed)

    def _rng(self, factor: str, *numbers: int) -> np.random.Generator:
        return np.random.default_rng((zlib.crc32(factor.encode()), *self.setup, *numbers))

    def of_size(self, task: Task) -> Task:
        """The task with its things at the size of the scene."""
        if "object_size" not in self.factors or task.sizes is None:
            return task
        return task.resized(self._rng("object_size", self.seed).uniform(*task.sizes))

    def furnish(self, spec: Any) -> None:
        """Add the distractors, see `SceneChange`."""
        if "distractors" in self.factors:
            add_distractors(spec, self._rng("distractors", self.seed, 0))

    def finish(self, task: Task, world: World) -> None:
        """Paint, light and bring the distractors.

        Raises:
            NoRoom: if a distractor finds no place.
        """
        if "object_color" in self.factors:
            _paint_things(task, world, self._rng("object_color", self.seed))
        if "light" in self.factors:
            world.light_color = self._rng("light", self.seed).uniform(0, 1, 3)
        if "table_color" in self.factors:
            color = self._rng("table_color", self.seed).uniform(0.25, 1, 3)
            _paint(world, world.model.geom_bodyid == world.model.body("table").id, color)
        if "distractors" in self.factors:
            place_distractors(task, world, self._rng("distractors", self.seed, 1))

    @property
    def cameras(self) -> Mapping[str, Camera]:
        """What the set-up has, before one is lost or moved."""
        return TWO_CAMERAS if "two_cameras" in self.factors else CAMERAS

    @cached_property
    def shown(self) -> Sensing:
        """How the demonstration is seen."""
        return Sensing(self._there(self.cameras), self._misplaced(), self._noise(), (*self.setup, 0))

    @cached_property
    def tested(self) -> Sensing:
        """How the test is seen."""
        cameras, errors = self.cameras, self._misplaced()
        if "camera_pose" in self.factors:
            cameras = _moved(cameras, self._rng("camera_pose", self.seed))
        if "knocked" in self.factors:
            knocks = _errors(self.cameras, self._rng("knocked", self.seed))
            errors = {name: knock @ errors.get(name, np.eye(4)) for name, knock in knocks.items()}
        return Sensing(self._there(cameras), errors, self._noise(), (*self.setup, 1, self.seed))

    def _there(self, cameras: Mapping[str, Camera]) -> Mapping[str, Camera]:
        lost = {_LEFT_OUT} if "fewer_cameras" in self.factors else set()
        return {name: camera for name, camera in cameras.items() if name not in lost}

    def _misplaced(self) -> dict[str, FloatArray]:
        return _errors(self.cameras, self._rng("calibration")) if "calibration" in self.factors else {}

    def _noise(self) -> DepthNoise | None:
        return DepthNoise.of_d415() if "d415" in self.factors else None


def _errors(cameras: Mapping[str, Camera], rng: np.random.Generator) -> dict[str, FloatArray]:
    return {name: calibration_error(rng, _DISTANCE, _ANGLE) for name in cameras}


def _moved(cameras: Mapping[str, Camera], rng: np.random.Generator) -> dict[str, Camera]:
    """The cameras, all but that on the hand a little elsewhere."""
    moved = {}
    for name, camera in cameras.items():
        shift, turn = rng.uniform(-_SHIFT, _SHIFT, 3), rng.uniform(-_TURN, _TURN, 3)
        T = camera.T_mount_camera
        elsewhere = se3.make(T[:3, :3] @ se3.euler(*turn), T[:3, 3] + shift)
        moved[name] = camera if camera.on_gripper else replace(camera, T_mount_camera=elsewhere)
    return moved


def _paint_things(task: Task, world: World, rng: np.random.Generator) -> None:
    """Give each thing that the expert works on one colour."""
    bodies = [int(world.model.body(w.frame).id) for w in task.waypoints(world)]
    for thing in dict.fromkeys(int(world.instances[body]) for body in bodies):
        if world.instance_names.get(thing, "") not in _ROOM:
            _paint(world, world.instances[world.model.geom_bodyid] == thing, rng.uniform(0, 1, 3))


def _paint(world: World, geoms: Any, color: FloatArray) -> None:
    seen = VISIBLE_GROUPS[world.model.geom_group] != 0
    world.model.geom_rgba[geoms & seen, :3] = color
