"""What was seen of a board: corners in the pictures of cameras, and where the hand was meanwhile."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from imop.calibration.board import Board
from imop.errors import InvalidInput
from imop.geometry import se3
from imop.types import FloatArray, IntArray, as_array, as_finite, as_intrinsics, as_pose, freeze

Mount = Literal["world", "hand"]
"""A camera that stands beside the robot, or one that moves with its hand."""
BoardPlace = Literal["hand", "table"]
"""A board that the hand holds, or one that lies still."""


@dataclass(frozen=True, eq=False)
class RigCamera:
    """What is known of a camera before it is calibrated.

    Attributes:
        mount: where it is fixed.
        width: of its pictures, pixels.
        height: of its pictures, pixels.
        intrinsics: (3, 3) pixels; None if they are to be found as well.
        distortion: (k,) OpenCV's coefficients k1, k2, p1, p2, ...; empty for none.
    """

    mount: Mount
    width: int
    height: int
    intrinsics: FloatArray | None = None
    distortion: FloatArray = field(default_factory=lambda: np.empty(0))

    def __post_init__(self) -> None:
        if self.mount not in ("world", "hand"):
            raise InvalidInput("mount", f"{self.mount!r}", "world (beside the robot) or hand")
        if self.width < 1 or self.height < 1:
            raise InvalidInput("width, height", f"{self.width} x {self.height}", "pixels, at least 1")
        distortion = as_finite("distortion", self.distortion, (None,))
        if len(distortion) not in (0, 4, 5, 8, 12, 14):
            raise InvalidInput("distortion", f"{len(distortion)} coefficients", "0, 4, 5, 8, 12 or 14")
        freeze(self, distortion=distortion)
        if self.intrinsics is not None:
            freeze(self, intrinsics=_checked_intrinsics(self.intrinsics, self.width, self.height))


def _checked_intrinsics(given: FloatArray, width: int, height: int) -> FloatArray:
    K = as_intrinsics("intrinsics", given)
    centre = K[0, 2] / width, K[1, 2] / height
    if not all(0.25 < share < 0.75 for share in centre):
        problem = (
            f"the optical axis meets pixel ({K[0, 2]:.0f}, {K[1, 2]:.0f}) of an image of {width} x {height}"
        )
        raise InvalidInput(
            "intrinsics", problem, "those of this image size; cameras have others for each size"
        )
    return K


@dataclass(frozen=True, eq=False)
class Corners:
    """Corners of the board in one picture.

    Attributes:
        ids: (N,) numbers of the corners on the board.
        pixels: (N, 2) where they are, u to the right and v down, integers at the middle of pixels.
    """

    ids: IntArray
    pixels: FloatArray

    def __post_init__(self) -> None:
        ids = as_array("ids", self.ids, (None,), np.int32)
        freeze(self, ids=ids, pixels=as_finite("pixels", self.pixels, (len(ids), 2)))


@dataclass(frozen=True, eq=False)
class Shot:
    """One pose of the robot, and what the cameras saw of the board there.

    Attributes:
        T_base_gripper: (4, 4) of the gripper in the frame of the arm's base.
        corners: camera -> corners; without the cameras that did not see the board.
        name: what messages call it.
    """

    T_base_gripper: FloatArray
    corners: Mapping[str, Corners]
    name: str = ""

    def __post_init__(self) -> None:
        T = as_pose("T_base_gripper", self.T_base_gripper)
        freeze(self, T_base_gripper=T, corners=dict(self.corners))


@dataclass(frozen=True, eq=False)
class Series:
    """All shots of one board that stayed where it was: in the hand, or on the table.

    Attributes:
        board: what was looked at.
        board_on: where it was.
        cameras: name -> what is known of it.
        shots: in the order in which they were taken.

    Raises:
        InvalidInput: if a shot has corners of an unknown camera or with unknown numbers, or if a camera moves
            with the board, so that nothing can be learned from it.
    """

    board: Board
    board_on: BoardPlace
    cameras: Mapping[str, RigCamera]
    shots: Sequence[Shot]

    def __post_init__(self) -> None:
        if self.board_on not in ("hand", "table"):
            raise InvalidInput("board_on", f"{self.board_on!r}", "hand or table")
        freeze(self, cameras=dict(self.cameras), shots=tuple(self.shots))
        for name, camera in self.cameras.items():
            if camera.mount == "hand" and self.board_on == "hand":
                problem = "camera and board are both on the hand, so each picture shows the same"
                raise InvalidInput(f"cameras.{name}", problem, "a board on the table for cameras on the hand")
        for shot in self.shots:
            for name, corners in shot.corners.items():
                if name not in self.cameras:
                    raise InvalidInput("corners", f"of a camera {name}", "one of " + ", ".join(self.cameras))
                if np.any((corners.ids < 0) | (corners.ids >= len(self.board.corners))):
                    accepted = f"0 to {len(self.board.corners) - 1} on this board"
                    raise InvalidInput("ids", f"up to {corners.ids.max()}", accepted)

    def shots_of(self, camera: str) -> list[int]:
        """Numbers of the shots in which a camera saw enough of the board."""
        return [i for i, shot in enumerate(self.shots) if camera in shot.corners]

    def motion(self, camera: str, T_base_gripper: FloatArray) -> FloatArray:
        """The known link M (..., 4, 4) of T_camera_board = inv(X) M Y.

        X is the camera's pose where it is mounted (base or gripper), Y the board's pose where it is (base or
        gripper).
        """
        if self.board_on == "hand":
            return T_base_gripper
        if self.cameras[camera].mount == "hand":
            return se3.invert(T_base_gripper)
        return np.broadcast_to(np.eye(4), T_base_gripper.shape)
