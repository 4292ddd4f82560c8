"""Series whose true poses are known: corners of a board as a camera would see them, with noise."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from imop.calibration.board import Board
from imop.calibration.detect import FEW, project
from imop.calibration.refine import Poses
from imop.calibration.series import BoardPlace, Corners, Mount, RigCamera, Series, Shot
from imop.geometry import se3
from imop.types import FloatArray

WIDTH, HEIGHT = 640, 480
INTRINSICS = np.array([[615.0, 0.0, 322.0], [0.0, 615.0, 238.0], [0.0, 0.0, 1.0]])
"""As a RealSense D415's colour camera has them at this size."""
TILT = np.radians(25.0)
"""Standard deviation of how the hand is turned from looking straight, about each axis."""
BOARD_MIDDLE = np.array([0.5, 0.0, 0.35])
"""Where a hand that shows the board is, metres in the frame of the arm's base."""
CAMERAS_BESIDE = {"left": np.array([1.15, 0.25, 0.65]), "right": np.array([1.1, -0.35, 0.6])}
"""Where cameras beside the robot are, metres in the frame of the arm's base."""
CAMERA_ON_HAND = se3.make(se3.euler(x=0.1, z=np.pi / 2), (-0.06, 0.01, -0.09))


@dataclass(frozen=True)
class Noise:
    """What goes wrong in a series, standard deviations.

    Attributes:
        pixels: of each coordinate of a corner.
        distance: of each coordinate of the gripper's position, metres.
        angle: of the gripper's turn about each axis, radians.
    """

    pixels: float = 0.3
    distance: float = 0.0
    angle: float = 0.0


@dataclass(frozen=True, eq=False)
class Truth:
    """A rig with one camera.

    Attributes:
        board: what is looked at.
        mount: of the camera, which decides where the board is as well.
        T_mount_camera: (4, 4), in the frame of the arm's base or of the gripper.
        T_place_board: (4, 4), in the other of both frames.
    """

    board: Board
    mount: Mount
    T_mount_camera: FloatArray
    T_place_board: FloatArray

    @property
    def board_on(self) -> BoardPlace:
        """Where the board is: opposite to the camera."""
        return "hand" if self.mount == "world" else "table"

    @property
    def poses(self) -> Poses:
        """What a calibration should find."""
        return Poses({"camera": self.T_mount_camera}, self.T_place_board)

    def series(self, T_base_gripper: FloatArray, rng: np.random.Generator, noise: Noise) -> Series:
        """What the camera sees of the board with the gripper at poses (N, 4, 4)."""
        camera = RigCamera(self.mount, WIDTH, HEIGHT, INTRINSICS)
        empty = Series(self.board, self.board_on, {"camera": camera}, ())
        T = se3.invert(self.T_mount_camera) @ empty.motion("camera", T_base_gripper) @ self.T_place_board
        shots = []
        for i, (T_camera_board, T_gripper) in enumerate(zip(T, T_base_gripper, strict=True)):
            corners = _seen(self.board, T_camera_board, rng, noise.pixels)
            error = se3.make(
                Rotation.from_rotvec(rng.normal(0, noise.angle, 3)).as_matrix(),
                rng.normal(0, noise.distance, 3),
            )
            shots.append(Shot(T_gripper @ error, {} if corners is None else {"camera": corners}, f"shot {i}"))
        return Series(self.board, self.board_on, {"camera": camera}, shots)


def random_truth(rng: np.random.Generator, mount: Mount, board: Board | None = None) -> Truth:
    """A camera and a board about where people put them."""
    board = board or Board()
    middle = np.array([board.size[0] / 2, board.size[1] / 2, 0.0])
    if mount == "world":
        T_camera = se3.make(looking(BOARD_MIDDLE - CAMERAS_BESIDE["left"]), CAMERAS_BESIDE["left"])
        # The gripper holds the board before its fingers, its face forward: the board's z looks back.
        T_gripper_board = se3.make(se3.euler(x=np.pi), (0.0, 0.0, 0.04)) @ se3.make(p=-middle)
        return Truth(
            board, mount, T_camera @ _wobble(rng, 0.05, 0.2), T_gripper_board @ _wobble(rng, 0.02, 0.2)
        )
    T_base_board = se3.make(se3.euler(x=np.pi), (0.5, 0.0, 0.02)) @ se3.make(p=-middle)
    return Truth(
        board, mount, CAMERA_ON_HAND @ _wobble(rng, 0.02, 0.1), T_base_board @ _wobble(rng, 0.05, 0.2)
    )


def random_poses(rng: np.random.Generator, truth: Truth, n: int, tilt: float = TILT) -> FloatArray:
    """(n, 4, 4) T_base_gripper from which the camera sees most of the board."""
    found: list[FloatArray] = []
    middle = se3.make(p=(truth.board.size[0] / 2, truth.board.size[1] / 2, 0.0))
    while len(found) < n:
        distance, angle = rng.uniform(0.4, 0.75), rng.normal(0, tilt, 3)
        aside = np.append(rng.uniform(-0.12, 0.12, 2) * distance, distance)
        T_camera_board = se3.make(p=aside) @ se3.make(se3.euler(*angle)) @ se3.invert(middle)
        corners = _seen(truth.board, T_camera_board, rng, 0.0)
        if corners is None or len(corners.ids) < len(truth.board.corners) // 2:
            continue
        if truth.mount == "world":
            found.append(truth.T_mount_camera @ T_camera_board @ se3.invert(truth.T_place_board))
        else:
            found.append(truth.T_place_board @ se3.invert(T_camera_board) @ se3.invert(truth.T_mount_camera))
    return np.stack(found)


def knocked(truth: Truth, rng: np.random.Generator, distance: float, angle: float) -> Truth:
    """The same rig after its camera was moved by metres and radians in random directions."""
    shift, axis = (v / np.linalg.norm(v) for v in rng.normal(size=(2, 3)))
    T = truth.T_mount_camera @ se3.make(Rotation.from_rotvec(angle * axis).as_matrix(), distance * shift)
    return Truth(truth.board, truth.mount, T, truth.T_place_board)


def _seen(board: Board, T_camera_board: FloatArray, rng: np.random.Generator, noise: float) -> Corners | None:
    if np.any(se3.apply(T_camera_board, board.corners)[:, 2] < 0.05) or T_camera_board[2, 2] < 0.3:
        return None  # behind the camera, or seen from behind or too flat
    pixels = project(T_camera_board, board.corners, INTRINSICS)
    pixels = pixels + rng.normal(0, noise, pixels.shape)
    inside = np.all((pixels > 4) & (pixels < np.array([WIDTH, HEIGHT]) - 5), axis=1)
    if inside.sum() < FEW:
        return None
    return Corners(np.flatnonzero(inside).astype(np.int32), pixels[inside])


def looking(direction: FloatArray) -> FloatArray:
    """(3, 3) of an upright camera that looks along a direction."""
    z = direction / np.linalg.norm(direction)
    x = np.cross(z, (0.0, 0.0, 1.0))
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=1)


def _wobble(rng: np.random.Generator, distance: float, angle: float) -> FloatArray:
    return se3.make(se3.euler(*rng.normal(0, angle, 3)), rng.normal(0, distance, 3))
