"""All corners of all pictures decide: least squares over the cameras' poses and the board's."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from imop.calibration.series import Corners, Series
from imop.geometry import se3
from imop.types import FloatArray, IntArray

OUTLIER = 1.0
"""Pixels from which an error counts less than by its square."""
NEAREST = 0.02
"""Metres before a camera behind which nothing is projected."""


@dataclass(frozen=True, eq=False)
class Poses:
    """What is sought.

    Attributes:
        cameras: name -> (4, 4) T_base_camera, or T_gripper_camera of a camera on the hand.
        board: (4, 4) T_gripper_board, or T_base_board of a board on the table.
    """

    cameras: Mapping[str, FloatArray]
    board: FloatArray


@dataclass(frozen=True, eq=False)
class Refined:
    """The best poses.

    Attributes:
        poses: they.
        scale: of the board: 1.02 if its squares are two percent larger than said; 1 if that was not asked.
        errors: camera -> (N, 2) pixels that corners lie from where they should, in the order of `seen_by`.
        shot: camera -> (N,) number of the shot of each.
        deviation: of a coordinate of a corner, pixels, robust.
        independent: (n, n) as `covariance`, if the corners of a picture erred independently by a pixel.
        covariance: (n, n) of the turns (radians) and shifts (metres) of the cameras in their own frames, six
            each in the order of `poses.cameras`, then the board's, then of the scale's logarithm, as far as
            they were free.
    """

    poses: Poses
    scale: float
    errors: Mapping[str, FloatArray]
    shot: Mapping[str, IntArray]
    deviation: float
    independent: FloatArray
    covariance: FloatArray

    def rms(self, camera: str | None = None) -> float:
        """Root of the mean square of the distances in pixels, of one camera or all."""
        names = self.errors if camera is None else [camera]
        squares = np.concatenate([np.square(self.errors[name]).sum(axis=1) for name in names])
        return float(np.sqrt(squares.mean())) if len(squares) else float("nan")

    def median(self, camera: str | None = None) -> float:
        """Median of the distances in pixels, of one camera or all."""
        names = self.errors if camera is None else [camera]
        distances = np.concatenate([np.linalg.norm(self.errors[name], axis=1) for name in names])
        return float(np.median(distances)) if len(distances) else float("nan")


@dataclass(frozen=True, eq=False)
class _Seen:
    """All corners of one camera: numbers of their shots, points of the board, pixels, known motions."""

    intrinsics: FloatArray
    shot: IntArray
    points: FloatArray
    pixels: FloatArray
    M: FloatArray

    def errors(self, X: FloatArray, Y: FloatArray, scale: float) -> tuple[FloatArray, FloatArray]:
        """(2 N,) pixels, and (2 N, 13) their derivatives by motions of camera and board and by log scale."""
        T = (se3.invert(X) @ self.M @ Y)[self.shot]
        points = scale * self.points
        p = np.einsum("nij,nj->ni", T[:, :3, :3], points) + T[:, :3, 3]
        z = np.maximum(p[:, 2], NEAREST)
        f, centre = self.intrinsics[[0, 1], [0, 1]], self.intrinsics[:2, 2]
        off = p[:, :2] / z[:, None] * f + centre - self.pixels
        to_pixels = np.zeros((len(p), 2, 3))
        to_pixels[:, 0, 0], to_pixels[:, 1, 1] = f[0] / z, f[1] / z
        to_pixels[:, :, 2] = -p[:, :2] * f / z[:, None] ** 2
        by_board = to_pixels @ T[:, :3, :3]
        parts = [
            to_pixels @ _cross(p),
            -to_pixels,
            -by_board @ _cross(points),
            by_board,
            by_board @ points[..., None],
        ]
        return off.ravel(), np.concatenate(parts, axis=2).reshape(-1, 13)


def refine(
    series: Series,
    pictures: Mapping[str, Mapping[int, Corners]],
    start: Poses,
    shots: Sequence[int] | None = None,
    free_scale: bool = False,
    fixed_board: bool = False,
) -> Refined:
    """The poses that put all corners nearest to where they were seen.

    Args:
        series: what was seen; its cameras have intrinsics.
        pictures: camera -> number of the shot -> corners without distortion.
        start: poses near the right ones.
        shots: numbers of the shots to use; all if not given.
        free_scale: whether the size of the board is sought as well.
        fixed_board: whether the board's pose is known.
    """
    used = set(range(len(series.shots))) if shots is None else set(shots)
    names = list(start.cameras)
    seen = [_seen(series, name, pictures[name], used) for name in names]
    n = 6 * len(names)
    free = np.arange(n + 7)[[True] * n + [not fixed_board] * 6 + [free_scale]]

    def errors(x: FloatArray) -> tuple[FloatArray, FloatArray]:
        poses, scale = _moved_poses(start, x)
        by_board = _by_parameters(x[n : n + 6])
        rows, columns = [], []
        for i, camera in enumerate(seen):
            off, J = camera.errors(poses.cameras[names[i]], poses.board, scale)
            wide = np.zeros((len(off), n + 7))
            wide[:, 6 * i : 6 * i + 6] = J[:, :6] @ _by_parameters(x[6 * i : 6 * i + 6])
            wide[:, n : n + 6], wide[:, -1] = J[:, 6:12] @ by_board, J[:, 12]
            rows.append(off)
            columns.append(wide)
        return np.concatenate(rows), np.concatenate(columns)

    def spread(x: FloatArray) -> FloatArray:
        whole = np.zeros(n + 7)
        whole[free] = x
        return whole

    # The solver asks for both at the same place, one after the other.
    last: dict[bytes, tuple[FloatArray, FloatArray]] = {}

    def both(x: FloatArray) -> tuple[FloatArray, FloatArray]:
        key = x.tobytes()
        if key not in last:
            off, J = errors(spread(x))
            last.clear()
            last[key] = off, J[:, free]
        return last[key]

    def residuals(x: FloatArray) -> FloatArray:
        return both(x)[0]

    def derivatives(x: FloatArray) -> FloatArray:
        return both(x)[1]

    found = least_squares(
        residuals,
        np.zeros(len(free)),
        jac=derivatives,
        loss="soft_l1",
        f_scale=OUTLIER,
        x_scale="jac",
        max_nfev=100,
    )
    poses, scale = _moved_poses(start, spread(found.x))
    ends = np.cumsum([0, *(2 * len(camera.shot) for camera in seen)])
    off, J = both(found.x)
    shot = np.concatenate([np.repeat(camera.shot, 2) for camera in seen])
    independent, covariance = _covariances(off, J, shot)
    return Refined(
        poses,
        scale,
        {name: off[a:b].reshape(-1, 2) for name, a, b in zip(names, ends, ends[1:], strict=False)},
        {name: camera.shot for name, camera in zip(names, seen, strict=True)},
        float(1.4826 * np.median(np.abs(off))),
        independent,
        covariance,
    )


def _moved_poses(start: Poses, x: FloatArray) -> tuple[Poses, float]:
    names = list(start.cameras)
    cameras = {name: start.cameras[name] @ moved(x[6 * i : 6 * i + 6]) for i, name in enumerate(names)}
    return Poses(cameras, start.board @ moved(x[-7:-1])), float(np.exp(x[-1]))


def moved(twist: FloatArray) -> FloatArray:
    """The motion (4, 4) that turns by twist[:3] (rotation vector) and shifts by twist[3:]."""
    return se3.make(Rotation.from_rotvec(twist[:3]).as_matrix(), twist[3:])


def _by_parameters(twist: FloatArray) -> FloatArray:
    """(6, 6) how `moved` turns and shifts further, in its own frame, as the twist grows."""
    w = twist[:3]
    angle, W = float(np.linalg.norm(w)), _cross(w[None])[0]
    J = np.zeros((6, 6))
    small = angle < 1e-6
    a = 0.5 if small else (1 - np.cos(angle)) / angle**2
    b = 1 / 6 if small else (angle - np.sin(angle)) / angle**3
    J[:3, :3] = np.eye(3) - a * W + b * W @ W
    J[3:, 3:] = Rotation.from_rotvec(w).as_matrix().T
    return J


def _cross(v: FloatArray) -> FloatArray:
    """(N, 3, 3) matrices C with C u = v x u, of v (N, 3)."""
    C = np.zeros((len(v), 3, 3))
    C[:, 2, 1], C[:, 0, 2], C[:, 1, 0] = v.T
    C[:, 1, 2], C[:, 2, 0], C[:, 0, 1] = -v.T
    return C


def _covariances(errors: FloatArray, J: FloatArray, shot: IntArray) -> tuple[FloatArray, FloatArray]:
    """Of the parameters, for independent errors of a pixel, and by the scatter from shot to shot.

    The second is White's (1980) with shots as clusters, for errors of the robot act on all corners of one;
    `shot` is the number of each row's.
    """
    weight = (1 + (errors / OUTLIER) ** 2) ** -0.5
    bread = np.asarray(np.linalg.pinv((J * weight[:, None]).T @ J), dtype=np.float64)
    scores = np.stack(
        [(J[shot == i] * (weight * errors)[shot == i, None]).sum(axis=0) for i in np.unique(shot)]
    )
    # Each shot tells six numbers of the pose of the board.
    many = 6 * len(scores)
    return bread, np.asarray(bread @ scores.T @ scores @ bread * many / max(many - J.shape[1], 1))


def _seen(series: Series, name: str, pictures: Mapping[int, Corners], used: set[int]) -> _Seen:
    K = series.cameras[name].intrinsics
    assert K is not None
    numbers = [i for i in sorted(pictures) if i in used]
    points = series.board.corners
    corners = [pictures[i] for i in numbers]
    poses = np.stack([shot.T_base_gripper for shot in series.shots])
    return _Seen(
        K,
        np.repeat(np.array(numbers, dtype=np.int32), [len(c.ids) for c in corners]),
        np.concatenate([points[c.ids] for c in corners] or [np.empty((0, 3))]),
        np.concatenate([c.pixels for c in corners] or [np.empty((0, 2))]),
        series.motion(name, poses),
    )
