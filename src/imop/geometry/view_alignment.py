"""Small errors of the cameras' poses, found from views that show the same surfaces in different places.

All pairs of views are laid onto each other at once, points to planes. What the views cannot tell, such as
whether one slides along a bare table or whether all are wrong alike, stays as it was said to be.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial.transform import Rotation

from imop.geometry import se3
from imop.types import BoolArray, CameraView, FloatArray, Observation

# How wrong a camera's pose may be (radians, metres): standard deviations of its rotation and its position.
LIKELY = np.repeat([np.radians(1.0), 0.005], 3)
# Standard deviation of a distance between two views of a surface, metres, if about thirty points err alike.
NOISE = 0.003 * np.sqrt(30)
# How far counterparts may be from each other's planes, metres, from the first round to the last.
REACHES = (0.04, 0.03, 0.025, 0.02, 0.015, 0.012, 0.01, 0.008, 0.008)
# Views agree if the best motions move no surface across itself by more than this on average, metres.
AGREE = 0.0007
# Cosine of the angle between the normals of counterparts.
ALIKE = 0.8
# Second difference of inverse depth (1 / m) from which a pixel is at an edge.
EDGE = 0.01
# Pixels this near to the largest plane of a view lie in it, if it has at least this share of them, metres.
THICK, LARGE = 0.008, 0.25
# How many points of each view are laid onto the others: of what is not in that plane, and of the plane.
OTHER, PLAIN = 800, 300
# Fewer counterparts than this are no overlap.
FEW = 30


@dataclass(frozen=True, eq=False)
class _Planes:
    """The planes that touch the surface at the pixels of a view, in its camera's frame.

    Attributes:
        intrinsics: (3, 3).
        normals: (H, W, 3) away from the camera; zero at edges and where nothing was measured.
        offsets: (H, W) metres; points p of the plane have normal . p = offset.
        points: (N, 3) points that are laid onto other views.
        directions: (N, 3) their normals.
    """

    intrinsics: FloatArray
    normals: FloatArray
    offsets: FloatArray
    points: FloatArray
    directions: FloatArray


def find_errors(
    observations: Sequence[Observation], known: Mapping[str, FloatArray] | None = None
) -> dict[str, FloatArray]:
    """What has to be done to the cameras' poses so that views agree, the same in all observations.

    Args:
        observations: of one set-up; no joint is moved between the views of one observation.
        known: errors found before; the new ones are near to them.

    Returns:
        For each camera, in its own frame, T_said_true (4, 4): T_world_camera @ T_said_true is its pose. These
        are the known ones, or identities, where views agree already.
    """
    names = list(dict.fromkeys(name for o in observations for name in o.views))
    start = np.stack([(known or {}).get(name, np.eye(4)) for name in names])
    frames = [_Frame.of(observation, names) for observation in observations]
    T = start.copy()
    for reach in REACHES:
        pairs = [pair for frame in frames for pair in frame.pairs(T, reach)]
        step = _step(pairs, _twists(se3.invert(start) @ T), reach)
        if reach == REACHES[0] and _nearer(pairs, step) < AGREE:
            break
        T = T @ se3.make(Rotation.from_rotvec(step[:, :3]).as_matrix(), step[:, 3:])
    return dict(zip(names, T, strict=True))


def corrected(observation: Observation, errors: Mapping[str, FloatArray]) -> Observation:
    """The observation with the right poses of the cameras whose errors are known."""
    views = {
        name: replace(view, T_world_camera=view.T_world_camera @ errors[name]) if name in errors else view
        for name, view in observation.views.items()
    }
    return replace(observation, views=views)


def disagreement(observation: Observation) -> float:
    """Mean distance between what a view shows and the planes of the others, metres; NaN without overlap."""
    frame = _Frame.of(observation, list(observation.views))
    still = np.broadcast_to(np.eye(4), (len(observation.views), 4, 4))
    distances = [np.abs(pair.distance) for pair in frame.pairs(still, REACHES[0])]
    return float(np.concatenate(distances).mean()) if distances else float("nan")


@dataclass(frozen=True, eq=False)
class _Pair:
    """Points of camera `a` and the planes of camera `b` that they lie in or near.

    Attributes:
        a, b: numbers of the cameras.
        distance: (N,) of the points from the planes, metres.
        J_a, J_b: (N, 6) its derivatives by rotation and shift of the cameras, each in its own frame.
    """

    a: int
    b: int
    distance: FloatArray
    J_a: FloatArray
    J_b: FloatArray


@dataclass(frozen=True, eq=False)
class _Frame:
    """The views of one observation, by the numbers of their cameras."""

    planes: Mapping[int, _Planes]
    T_world_camera: Mapping[int, FloatArray]

    @classmethod
    def of(cls, observation: Observation, names: Sequence[str]) -> "_Frame":
        views = {names.index(name): view for name, view in observation.views.items()}
        poses = {number: view.T_world_camera for number, view in views.items()}
        return cls({number: _planes(view) for number, view in views.items()}, poses)

    def pairs(self, T: FloatArray, reach: float) -> list[_Pair]:
        """All pairs of views that overlap with the cameras' errors T (C, 4, 4)."""
        poses = {number: pose @ T[number] for number, pose in self.T_world_camera.items()}
        found = []
        for a, points in self.planes.items():
            for b, planes in self.planes.items():
                if a != b:
                    T_b_a = se3.invert(poses[b]) @ poses[a]
                    pair = _counterparts(a, b, points, planes, T_b_a, reach)
                    found += [pair] if len(pair.distance) >= FEW else []
        return found


def _step(pairs: Sequence[_Pair], moved: FloatArray, reach: float) -> FloatArray:
    """(C, 6) the next motions of cameras that have `moved` (C, 6) from where they were said to be."""
    prior = np.tile(LIKELY**-2, len(moved))
    H, g = np.diag(prior), prior * moved.ravel()
    for pair in pairs:
        # Geman and McClure's weights: what is far from its plane is of another surface.
        weight = (1 + (pair.distance / (reach / 2)) ** 2) ** -2 / NOISE**2
        J = np.hstack([pair.J_a, pair.J_b])
        at = np.concatenate([6 * pair.a + np.arange(6), 6 * pair.b + np.arange(6)])
        weighted = J * weight[:, None]
        H[np.ix_(at, at)] += weighted.T @ J
        g[at] += weighted.T @ pair.distance
    return np.asarray(-np.linalg.solve(H, g).reshape(-1, 6))


def _nearer(pairs: Sequence[_Pair], step: FloatArray) -> float:
    """How far motions (C, 6) move surfaces across themselves: root of the mean square, metres."""
    across = [pair.J_a @ step[pair.a] + pair.J_b @ step[pair.b] for pair in pairs]
    return float(np.sqrt(np.mean(np.concatenate(across) ** 2))) if across else 0.0


def _twists(T: FloatArray) -> FloatArray:
    """(C, 6) rotation vectors and shifts of small motions (C, 4, 4)."""
    return np.hstack([Rotation.from_matrix(T[:, :3, :3]).as_rotvec(), T[:, :3, 3]])


def _planes(view: CameraView) -> _Planes:
    """Planes from the slope of inverse depth, which is linear in the pixels of a plane."""
    K, measured = view.intrinsics, view.measured
    inverse = np.where(measured, 1 / np.where(measured, view.depth, 1.0).astype(np.float64), 0.0)
    smooth = ndimage.uniform_filter(inverse, 3)
    edge = ndimage.maximum_filter(_edges(inverse) | ~measured, 3)
    rows, columns = np.indices(inverse.shape)
    x, y = (columns - K[0, 2]) / K[0, 0], (rows - K[1, 2]) / K[1, 1]
    by_row, by_column = np.gradient(smooth)
    A, B = by_column * K[0, 0], by_row * K[1, 1]
    slopes = np.stack([A, B, smooth - A * x - B * y], axis=-1)
    rays = np.stack([x, y, np.ones_like(x)], axis=-1)
    plain = _largest_plane(slopes, rays, inverse, measured)
    length = np.sqrt(np.einsum("hwk,hwk->hw", slopes, slopes))
    flat = (plain | ~edge) & (length > 1e-6)
    normals = np.where(flat[..., None], slopes / np.maximum(length, 1e-6)[..., None], 0.0)
    offsets = np.where(flat, 1 / np.maximum(length, 1e-6), 0.0)
    sample = _some(np.flatnonzero(flat & ~plain), OTHER), _some(np.flatnonzero(plain), PLAIN)
    chosen = np.unravel_index(np.concatenate(sample), flat.shape)
    directions = normals[chosen]
    along = np.einsum("nk,nk->n", rays[chosen], directions)
    good = along > 0.05
    distance = offsets[chosen][good] / along[good]
    return _Planes(K, normals, offsets, rays[chosen][good] * distance[:, None], directions[good])


def _largest_plane(
    slopes: FloatArray, rays: FloatArray, inverse: FloatArray, measured: BoolArray
) -> BoolArray:
    """(H, W) which pixels lie in the plane that most do; their slopes (H, W, 3) become those of the plane.

    Noise tilts every small piece of a table, and then it seems to tell whether a view slides along it.
    """
    i, x = inverse[measured][::4], rays[measured][::4]
    if len(i) < FEW:
        return np.zeros(inverse.shape, dtype=bool)
    plane: FloatArray = np.median(slopes[measured][::4], axis=0)
    for reach in (4 * THICK, 2 * THICK, THICK):
        # An error of inverse depth times the depth squared is one of depth.
        near = np.abs(x @ plane - i) < reach * i**2
        if near.mean() < LARGE:
            return np.zeros(inverse.shape, dtype=bool)
        plane = np.asarray(np.linalg.lstsq(x[near], i[near], rcond=None)[0], dtype=np.float64)
    plain = measured & (np.abs(rays @ plane - inverse) < THICK * inverse**2)
    slopes[plain] = plane
    return plain


def _edges(inverse: FloatArray) -> BoolArray:
    """(H, W) where inverse depth bends more than on a surface."""
    edge = np.zeros(inverse.shape, dtype=bool)
    edge[:, 1:-1] |= np.abs(inverse[:, 2:] + inverse[:, :-2] - 2 * inverse[:, 1:-1]) > EDGE
    edge[1:-1] |= np.abs(inverse[2:] + inverse[:-2] - 2 * inverse[1:-1]) > EDGE
    return edge


def _some(of: NDArray[np.intp], count: int) -> NDArray[np.intp]:
    return of if len(of) <= count else of[np.linspace(0, len(of) - 1, count).astype(int)]


def _counterparts(a: int, b: int, source: _Planes, target: _Planes, T_b_a: FloatArray, reach: float) -> _Pair:
    """What of `source` lies within `reach` of the plane that `target` shows in the same place."""
    p_b = se3.apply(T_b_a, source.points)
    before = p_b[:, 2] > 1e-3
    K = target.intrinsics
    u = p_b[:, 0] / np.where(before, p_b[:, 2], 1.0) * K[0, 0] + K[0, 2]
    v = p_b[:, 1] / np.where(before, p_b[:, 2], 1.0) * K[1, 1] + K[1, 2]
    height, width = target.offsets.shape
    inside = np.flatnonzero(before & (u > -0.5) & (u < width - 0.5) & (v > -0.5) & (v < height - 0.5))
    row, column = np.rint(v[inside]).astype(int), np.rint(u[inside]).astype(int)
    normals = target.normals[row, column]
    distance = np.einsum("nk,nk->n", normals, p_b[inside]) - target.offsets[row, column]
    facing = np.einsum("nk,nk->n", normals, se3.rotate(T_b_a, source.directions[inside]))
    good = np.flatnonzero((facing > ALIKE) & (np.abs(distance) < reach))
    picked, n_b = inside[good], normals[good]
    n_a, p_a = se3.rotate(se3.invert(T_b_a), n_b), source.points[picked]
    J_a = np.hstack([np.cross(p_a, n_a), n_a])
    return _Pair(a, b, distance[good], J_a, -np.hstack([np.cross(p_b[picked], n_b), n_b]))
