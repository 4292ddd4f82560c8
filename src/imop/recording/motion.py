"""What the arm did while it was recorded, and where its keyframes are."""

from dataclasses import dataclass

import numpy as np

from imop.demos.keyframes import gripper_states, pose_keyframes
from imop.errors import InvalidInput
from imop.types import BoolArray, FloatArray, as_finite, as_fraction, as_pose, freeze


@dataclass(frozen=True, eq=False)
class Motion:
    """State of the arm in n frames.

    Attributes:
        times: (n,) seconds, strictly increasing.
        T_world_gripper: (n, 4, 4) measured.
        gripper_opening: (n,) measured, 0 closed .. 1 open.
        joint_positions: (n, J) radians, or None if they were not recorded.

    Raises:
        InvalidInput: for a value that is none of these, or fewer than two frames.
    """

    times: FloatArray
    T_world_gripper: FloatArray
    gripper_opening: FloatArray
    joint_positions: FloatArray | None = None

    def __post_init__(self) -> None:
        times = as_finite("times", self.times, (None,))
        n, q = len(times), self.joint_positions
        if n < 2:
            raise InvalidInput("frames", f"{n} of them", "at least two")
        if not np.all(np.diff(times) > 0):
            late = int(np.flatnonzero(np.diff(times) <= 0)[0]) + 1
            problem = f"frame {late} is at {times[late]:.6f} s, the one before at {times[late - 1]:.6f} s"
            raise InvalidInput("times", problem, "seconds, every frame later than the one before")
        openings = as_finite("gripper_opening", self.gripper_opening, (n,))
        poses = as_finite("T_world_gripper", self.T_world_gripper, (n, 4, 4))
        freeze(
            self,
            times=times,
            T_world_gripper=np.stack([as_pose("T_world_gripper", T) for T in poses]),
            gripper_opening=np.array([as_fraction("gripper_opening", opening) for opening in openings]),
            joint_positions=None if q is None else as_finite("joint_positions", q, (n, None)),
        )

    def __len__(self) -> int:
        return len(self.times)

    def find_keyframes(self) -> list[int]:
        """Frames where the hand rested or the fingers moved, and the last one; increasing, none of them 0."""
        return pose_keyframes(self.T_world_gripper, self.gripper_opening, self.times)

    @property
    def gripper_open(self) -> BoolArray:
        """(n,) state of the gripper, see `gripper_states`."""
        return gripper_states(self.gripper_opening, self.times)
