"""The numbers of a recorded RLBench episode, frame by frame: what low_dim_obs.pkl contains."""

from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from imop.demos import unpickle
from imop.errors import CorruptData, InvalidInput
from imop.geometry.se3 import from_pose7
from imop.types import FloatArray, as_finite, as_pose, rotation_error

LOW_DIM = "low_dim_obs.pkl"

FINGER_STROKE = 0.04
FINGER_NOISE = 0.005
"""Recorded fingers stand up to this far (metres) outside their stroke."""

TIME_STEP = 0.05
"""Seconds from one frame to the next."""

# RLBench's model of the Panda has the zero of joint 4 turned by 4 degrees against Franka's.
PANDA_JOINTS, JOINT_4_OFFSET = 7, 0.0698


class Frame:
    """One moment; every read of a missing or malformed field is a CorruptData that names it."""

    def __init__(self, path: Path, index: int, fields: dict[str, Any]):
        misc = fields.get("misc")
        self.path, self.index = path, index
        self._fields = {**misc, **fields} if isinstance(misc, dict) else fields

    def has(self, name: str) -> bool:
        """Whether the field was recorded."""
        return self._fields.get(name) is not None

    def number(self, name: str) -> float:
        """A field that is one number."""
        return float(self.numbers(name, ()))

    def numbers(self, name: str, shape: tuple[int | None, ...]) -> FloatArray:
        """A field that is an array of `shape`, where None means any length."""
        if not self.has(name):
            raise CorruptData(self.path, f"frame {self.index} has no {name}", "record it with this field")
        try:
            return as_finite(name, self._fields[name], shape)
        except InvalidInput as error:
            raise CorruptData(self.path, f"frame {self.index}: {error}") from error

    @property
    def gripper_open(self) -> bool:
        """RLBench's own decision whether the gripper is open."""
        return self.number("gripper_open") > 0.5

    @property
    def gripper_opening(self) -> float:
        """0 closed .. 1 open."""
        fingers = self.numbers("gripper_joint_positions", (2,))
        if fingers.min() < -FINGER_NOISE or fingers.max() > FINGER_STROKE + FINGER_NOISE:
            problem = f"frame {self.index}: gripper_joint_positions are {fingers.tolist()}"
            remedy = f"give metres, 0 closed .. {FINGER_STROKE} open, for each of the two fingers"
            raise CorruptData(self.path, problem, remedy)
        return float(np.clip(fingers.mean() / FINGER_STROKE, 0.0, 1.0))

    @property
    def joint_positions(self) -> FloatArray:
        """(J,) radians; seven are taken for RLBench's Panda, and given in Franka's convention."""
        q = self.numbers("joint_positions", (None,)).copy()
        if len(q) == PANDA_JOINTS:
            q[3] += JOINT_4_OFFSET
        return q

    @property
    def T_world_gripper(self) -> FloatArray:
        """(4, 4); recordings by old versions of RLBench have only the quaternion."""
        if self.has("gripper_matrix"):
            return self.rigid("gripper_matrix")
        try:
            return from_pose7(self.numbers("gripper_pose", (7,)))
        except InvalidInput as error:
            raise CorruptData(self.path, f"frame {self.index}, gripper_pose: {error}") from error

    def rigid(self, name: str) -> FloatArray:
        """A (4, 4) field with the nearest rotation: rounding is mended, anything worse refused."""
        T = self.numbers(name, (4, 4)).copy()
        if 1e-12 < rotation_error(T[:3, :3]) < 1e-3 and np.linalg.det(T[:3, :3]) > 0:
            T[:3, :3] = Rotation.from_matrix(T[:3, :3]).as_matrix()
        try:
            return as_pose(name, T)
        except InvalidInput as problem:
            raise CorruptData(self.path, f"frame {self.index}, {problem}") from problem


def read_frames(path: Path) -> list[Frame]:
    """All frames of an episode.

    Args:
        path: the file low_dim_obs.pkl.

    Raises:
        CorruptData: if it is missing, damaged, unsafe, empty, or something else than a demonstration.
    """
    record = unpickle.load(path)
    observations = record.fields.get("_observations") if isinstance(record, unpickle.DemoRecord) else record
    if not isinstance(observations, list) or not all(
        isinstance(o, unpickle.ObservationRecord) for o in observations
    ):
        raise CorruptData(path, "does not contain a demonstration of RLBench (a Demo of Observations)")
    if not observations:
        raise CorruptData(path, "the demonstration has no frame")
    return [Frame(path, i, o.fields) for i, o in enumerate(observations)]
