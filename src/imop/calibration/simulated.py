"""A simulated cell to calibrate: the Panda, cameras whose true poses are known, and a board before them.

The arm is put at poses without physics, which a calibration does not need.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from imop.calibration.board import Board
from imop.calibration.collect import Rig
from imop.calibration.refine import Poses
from imop.calibration.series import BoardPlace
from imop.calibration.synthetic import BOARD_MIDDLE, CAMERA_ON_HAND, CAMERAS_BESIDE, looking
from imop.cameras.interfaces import Frame
from imop.errors import InvalidInput
from imop.extras import extra
from imop.geometry import se3
from imop.robots.interfaces import DONE, MotionResult
from imop.robots.panda import PANDA_HOME_Q, T_WORLD_BASE
from imop.types import ByteArray, CameraView, FloatArray, as_fraction, as_pose

with extra("sim"):
    from imop.sim.cameras import Camera as RayCamera
    from imop.sim.cameras import camera_view
    from imop.sim.depth_noise import DepthNoise
    from imop.sim.driver import SimulatedRobot
    from imop.sim.kinematics import inverse_kinematics
    from imop.sim.world import World, scene_spec

WIDTH, HEIGHT, FIELD_OF_VIEW = 640, 480, 2 * np.arctan(240 / 615)
"""About those of a RealSense D415."""
PAPER = 0.01
"""White paper around the board, metres."""
PER_SQUARE = 60
"""Pixels of a square in the picture of the board."""
_FINE = 3
"""Rays per pixel and axis that meet the board."""

Kind = Literal["beside", "hand"]
"""Two cameras beside the robot, or one on its hand."""


class PlacedArm(SimulatedRobot):
    """A `Robot` that is put where it should go, at once."""

    def move_to(
        self, T_base_gripper: FloatArray, *, straight: bool = False, allow_collisions: bool = False
    ) -> MotionResult:
        """Put the gripper at a pose (4, 4)."""
        T = T_WORLD_BASE @ as_pose("T_base_gripper", T_base_gripper)
        found = inverse_kinematics(T, PANDA_HOME_Q, 1)
        if not len(found):
            return MotionResult(False, "unreachable", "no joint positions put the gripper there")
        self.world.set_robot(found[0], self.world.gripper_opening)
        return DONE

    def move_gripper(self, opening: float) -> MotionResult:
        """Put the fingers at an opening, 0 closed .. 1 open."""
        self.world.set_robot(self.world.robot_q, as_fraction("opening", opening))
        return DONE


@dataclass(frozen=True, eq=False)
class BoardCamera:
    """A `Camera` that sees the simulated world, and the board in it.

    Attributes:
        world: what it looks at.
        camera: where it is.
        board: what is in the world as well.
        T_place_board: (4, 4) in the gripper's frame, or in that of the arm's base.
        board_on: which of both.
        noise: of depth.
        rng: of the noise.
    """

    world: World
    camera: RayCamera
    board: Board
    T_place_board: FloatArray
    board_on: BoardPlace
    noise: DepthNoise
    rng: np.random.Generator

    def capture(self) -> Frame:
        """A frame of the world as it is now."""
        view = self.noise.view(camera_view(self.world, self.camera, WIDTH, HEIGHT), self.rng)
        T_world_place = self.world.T_world_gripper if self.board_on == "hand" else T_WORLD_BASE
        drawn = draw_board(view, self.board, T_world_place @ self.T_place_board)
        return Frame(drawn.rgb, drawn.depth, drawn.intrinsics, self.world.time)


@dataclass(frozen=True, eq=False)
class Cell:
    """A simulated rig and the truth about it.

    Attributes:
        rig: robot and cameras.
        board: what they see.
        board_on: where it is.
        truth: what a calibration should find.
        T_base_gripper: (4, 4) from which the board is seen well.
        ahead: metres from the fingers to the point about which to turn the hand.
    """

    rig: Rig
    board: Board
    board_on: BoardPlace
    truth: Poses
    T_base_gripper: FloatArray
    ahead: float


def simulated_cell(
    kind: Kind,
    board: Board | None = None,
    knocked: Mapping[str, FloatArray] | None = None,
    noise: DepthNoise | None = None,
) -> Cell:
    """The Panda in an empty scene, with cameras named left and right beside it or wrist on its hand.

    Args:
        kind: where the cameras are; the board is where they see it move.
        board: what they see.
        knocked: camera -> (4, 4) motion in its own frame.
        noise: of depth; none if not given.

    Raises:
        InvalidInput: if `kind` is unknown, or no camera has the name of one that is knocked.
        MissingExtra: without MuJoCo or OpenCV.
    """
    if kind not in ("beside", "hand"):
        raise InvalidInput("simulated", f"{kind!r}", "beside or hand")
    board_on: BoardPlace = "hand" if kind == "beside" else "table"
    board, knocks = board or Board(), knocked or {}
    world = World(scene_spec())
    centre = se3.make(p=(-board.size[0] / 2, -board.size[1] / 2, 0.0))
    if kind == "beside":
        poses = {name: se3.make(looking(BOARD_MIDDLE - p), p) for name, p in CAMERAS_BESIDE.items()}
        place = se3.make(se3.euler(x=np.pi), (0.0, 0.0, 0.03)) @ centre
        towards = np.mean(list(CAMERAS_BESIDE.values()), axis=0) - BOARD_MIDDLE
        start, ahead = se3.make(looking(towards), BOARD_MIDDLE), 0.0
    else:
        poses = {"wrist": CAMERA_ON_HAND}
        place = se3.make(se3.euler(x=np.pi), (0.45, 0.0, 0.002)) @ centre
        start, ahead = se3.make(se3.euler(x=np.pi), (0.47, 0.0, 0.38)), 0.35
    for name in knocks:
        if name not in poses:
            raise InvalidInput("knocked", name, ", ".join(poses))
    poses = {name: T @ knocks.get(name, np.eye(4)) for name, T in poses.items()}
    on_hand = kind == "hand"
    cameras = {}
    for name, T in poses.items():
        ray = RayCamera(T if on_hand else T_WORLD_BASE @ T, FIELD_OF_VIEW, 3.0, on_hand)
        cameras[name] = BoardCamera(
            world, ray, board, place, board_on, noise or DepthNoise(), np.random.default_rng(0)
        )
    rig = Rig(PlacedArm(world), cameras, {name: "hand" if on_hand else "world" for name in poses})
    return Cell(rig, board, board_on, Poses(poses, place), start, ahead)


def draw_board(view: CameraView, board: Board, T_world_board: FloatArray) -> CameraView:
    """The view with a board at a pose (4, 4) in it, before what is farther and behind what is nearer."""
    T_camera_board = se3.invert(view.T_world_camera) @ T_world_board
    height, width = view.depth.shape
    box = _bounds(board, T_camera_board, view.intrinsics, width, height)
    if box is None or T_camera_board[2, 2] <= 0.05:
        return view
    columns, rows = box
    offsets = (np.arange(_FINE) - (_FINE - 1) / 2) / _FINE
    u = (np.arange(columns.start, columns.stop)[:, None] + offsets).ravel()
    v = (np.arange(rows.start, rows.stop)[:, None] + offsets).ravel()
    grey, depth = _meet(board, T_camera_board, view.intrinsics, *np.meshgrid(u, v))
    shape = (len(v) // _FINE, _FINE, len(u) // _FINE, _FINE)
    covered = (grey >= 0).reshape(shape).mean(axis=(1, 3))
    light = 0.75 + 0.2 * T_camera_board[2, 2]
    shade = light * np.maximum(grey, 0.0).reshape(shape).mean(axis=(1, 3)) / np.maximum(covered, 1e-9)
    z = depth.reshape(shape)[:, _FINE // 2, :, _FINE // 2]
    there = view.depth[rows, columns]
    front = (covered > 0) & ((there <= 0) | (z < there))
    rgb, whole = view.rgb.astype(np.float64), view.depth.copy()
    share = (covered * front)[..., None]
    rgb[rows, columns] = (1 - share) * rgb[rows, columns] + share * shade[..., None]
    whole[rows, columns] = np.where(front & (covered > 0.5), z, there)
    return replace(view, rgb=np.round(rgb).astype(np.uint8), depth=whole)


def _bounds(
    board: Board, T_camera_board: FloatArray, K: FloatArray, width: int, height: int
) -> tuple[slice, slice] | None:
    """Columns and rows of the picture that the board's sheet may cover."""
    x, y = np.array([-PAPER, board.size[0] + PAPER]), np.array([-PAPER, board.size[1] + PAPER])
    ends = se3.apply(T_camera_board, np.array([(a, b, 0.0) for a in x for b in y]))
    if np.any(ends[:, 2] < 0.05):
        return None
    pixels = ends[:, :2] / ends[:, 2:] * K[[0, 1], [0, 1]] + K[:2, 2]
    low = np.maximum(np.floor(pixels.min(axis=0)).astype(int) - 1, 0)
    high = np.minimum(np.ceil(pixels.max(axis=0)).astype(int) + 2, (width, height))
    return (slice(low[0], high[0]), slice(low[1], high[1])) if np.all(low < high) else None


def _meet(
    board: Board, T_camera_board: FloatArray, K: FloatArray, u: FloatArray, v: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Grey level (-1 beside the sheet) and depth where the rays of pixels meet the plane of the board."""
    rays = np.stack([(u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1], np.ones_like(u)], axis=-1)
    normal, origin = T_camera_board[:3, 2], T_camera_board[:3, 3]
    z = normal @ origin / np.maximum(rays @ normal, 1e-6)
    p = (rays * z[..., None] - origin) @ T_camera_board[:3, :2]
    beyond = np.maximum(-p, p - np.array(board.size)).max(axis=-1)
    picture: ByteArray = board.picture(PER_SQUARE)
    at = np.floor(p / board.square * PER_SQUARE).astype(int)
    column = np.clip(at[..., 0], 0, picture.shape[1] - 1)
    row = np.clip(at[..., 1], 0, picture.shape[0] - 1)
    grey = np.where(beyond <= 0, picture[row, column].astype(np.float64), 255.0)
    return np.where(beyond <= PAPER, grey, -1.0), z
