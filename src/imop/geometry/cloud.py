"""Point clouds in the world frame: fused from views, cropped, thinned, with normals."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import small_gicp
from numpy.typing import NDArray

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.types import BoolArray, CameraView, Float32Array, FloatArray, IntArray, Observation

# A pixel that hangs this far (metres) between its two neighbours belongs to neither surface.
FLYING_PIXEL_GAP = 0.03


@dataclass(frozen=True, eq=False)
class PointCloud:
    """Points of a scene and what is known of each.

    Attributes:
        points: (N, 3) float64, world frame, metres.
        colors: (N, 3) float32, 0 .. 1.
        camera: (N,) int32, number of the view (in the observation's order) that saw the point.
        normals: (N, 3) float64 unit vectors towards the camera, or None.
        ids: (N,) int32 instance ids, or None; only training may read them.
    """

    points: FloatArray
    colors: Float32Array
    camera: IntArray
    normals: FloatArray | None = None
    ids: IntArray | None = None

    def __len__(self) -> int:
        return len(self.points)

    def select(self, which: NDArray[np.bool_] | NDArray[np.integer]) -> "PointCloud":
        """The points picked by a mask (N,) or by indices."""
        # Rows are taken by index twice as fast as by a mask, which would be searched for every attribute.
        picked = np.asarray(which)
        rows = np.flatnonzero(picked) if picked.dtype == bool else picked
        return PointCloud(
            self.points.take(rows, axis=0),
            self.colors.take(rows, axis=0),
            self.camera[rows],
            None if self.normals is None else self.normals.take(rows, axis=0),
            None if self.ids is None else self.ids[rows],
        )


def unproject(view: CameraView) -> FloatArray:
    """(H, W, 3) world-frame points of every pixel; meaningless where depth is no measurement."""
    height, width = view.depth.shape
    u, v = np.meshgrid(np.arange(width), np.arange(height))
    depth = np.where(view.measured, view.depth, 0.0).astype(np.float64)
    T = view.T_world_camera
    rays = np.stack([u, v, np.ones_like(u)], axis=-1) @ (T[:3, :3] @ np.linalg.inv(view.intrinsics)).T
    points: FloatArray = rays * depth[..., None] + T[:3, 3]
    return points


def project(view: CameraView, p_world: FloatArray) -> tuple[NDArray[np.int64], FloatArray, BoolArray]:
    """Where a view would show points.

    Args:
        view: the camera.
        p_world: (N, 3) points, metres.

    Returns:
        (N, 2) nearest pixel, column and row, 0 where there is none; (N,) metres along the optical axis; (N,)
        whether the point lies before the camera and in its image.
    """
    p_camera = se3.apply(se3.invert(view.T_world_camera), p_world)
    z = p_camera[:, 2]
    before = z > 1e-3
    uv = (p_camera @ view.intrinsics.T)[:, :2] / np.where(before, z, 1.0)[:, None]
    pixel = np.where(before[:, None], np.round(uv), -1).astype(np.int64)
    inside = np.all((pixel >= 0) & (pixel < view.depth.shape[::-1]), axis=1)
    return np.where(inside[:, None], pixel, 0), z, inside


def flying_pixels(view: CameraView, gap: float = FLYING_PIXEL_GAP) -> BoolArray:
    """(H, W) True where a pixel lies more than `gap` behind one neighbour and before the opposite one."""
    depth = np.where(view.measured, view.depth, np.nan)
    flying = np.zeros(depth.shape, dtype=bool)
    for axis in (0, 1):
        before, here, after = (
            np.take(depth, range(k, depth.shape[axis] - 2 + k), axis=axis) for k in (0, 1, 2)
        )
        with np.errstate(invalid="ignore"):
            hangs = (np.minimum(here - before, after - here) > gap) | (
                np.minimum(before - here, here - after) > gap
            )
        inner = [slice(None), slice(None)]
        inner[axis] = slice(1, -1)
        flying[tuple(inner)] |= hangs
    return flying


def fuse(observation: Observation) -> PointCloud:
    """All measured points of all views, without flying pixels.

    Raises:
        InvalidInput: if no view has a single measurement.
    """
    parts = []
    with_ids = all(view.instance_ids is not None for view in observation.views.values())
    for number, view in enumerate(observation.views.values()):
        keep = np.flatnonzero(view.measured & ~flying_pixels(view))
        points = unproject(view).reshape(-1, 3).take(keep, axis=0)
        colors = view.rgb.reshape(-1, 3).take(keep, axis=0)
        ids = view.instance_ids.ravel()[keep] if with_ids and view.instance_ids is not None else None
        camera = np.full(len(keep), number, dtype=np.int32)
        parts.append(PointCloud(points, colors.astype(np.float32) / np.float32(255), camera, None, ids))
    cloud = concatenate(parts)
    if not len(cloud):
        raise InvalidInput(
            "depth",
            "no view has a measurement: every pixel is 0, NaN or inf",
            "metres along the optical axis in at least one view",
        )
    return cloud


def concatenate(clouds: Sequence[PointCloud]) -> PointCloud:
    """One cloud of several; normals and ids survive if all of them have them."""
    normals = [c.normals for c in clouds if c.normals is not None]
    ids = [c.ids for c in clouds if c.ids is not None]
    return PointCloud(
        np.concatenate([c.points for c in clouds]),
        np.concatenate([c.colors for c in clouds]),
        np.concatenate([c.camera for c in clouds]),
        np.concatenate(normals) if len(normals) == len(clouds) else None,
        np.concatenate(ids) if len(ids) == len(clouds) else None,
    )


def crop(
    cloud: PointCloud, lower: FloatArray | Sequence[float], upper: FloatArray | Sequence[float]
) -> PointCloud:
    """The points inside the axis-aligned box, bounds (3,) in metres, included."""
    return cloud.select(inside_box(cloud.points, lower, upper))


def inside_box(
    points: FloatArray, lower: FloatArray | Sequence[float], upper: FloatArray | Sequence[float]
) -> BoolArray:
    """(N,) which points (N, 3) are inside the axis-aligned box, bounds (3,) included."""
    inside = np.ones(len(points), dtype=bool)
    # Column by column: reducing rows of three is several times as slow.
    for column, low, high in zip(points.T, lower, upper, strict=True):
        inside &= (column >= low) & (column <= high)
    return inside


def voxel_downsample(cloud: PointCloud, size: float) -> PointCloud:
    """One point per occupied cell of a grid with edge `size`, fixed to the world's origin.

    Points, colours and normals are averages over the cell; camera and id are its first point's.

    Raises:
        InvalidInput: if `size` is not positive.
    """
    if not size > 0:
        raise InvalidInput("size", f"{size}", "a positive edge length in metres")
    first, cell, counts = grid_cells(np.floor(cloud.points / size).astype(np.int64))

    def mean(values: NDArray[np.floating]) -> FloatArray:
        columns = [np.bincount(cell, weights=column, minlength=len(counts)) for column in values.T]
        return np.stack(columns, axis=1) / counts[:, None]

    normals = None
    if cloud.normals is not None:
        normals = mean(cloud.normals)
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    return PointCloud(
        mean(cloud.points),
        mean(cloud.colors).astype(np.float32),
        cloud.camera[first],
        normals,
        None if cloud.ids is None else cloud.ids[first],
    )


def grid_cells(cells: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Which points share a cell of a grid.

    Args:
        cells: (N, 3) integer coordinates.

    Returns:
        (C,) index of the first point of each occupied cell, (N,) number of each point's cell, (C,) number of
        points in each cell; cells in lexicographic order.
    """
    if not len(cells):
        nothing = np.zeros(0, dtype=np.int64)
        return nothing, nothing, nothing
    low = cells.min(axis=0)
    shape = cells.max(axis=0) - low + 1
    # One number per cell sorts several times as fast as rows; a cloud of metres at millimetres fits easily.
    flat = ((cells[:, 0] - low[0]) * shape[1] + cells[:, 1] - low[1]) * shape[2] + cells[:, 2] - low[2]
    _, first, cell, counts = np.unique(flat, return_index=True, return_inverse=True, return_counts=True)
    return first, cell.reshape(-1), counts


def farthest_points(points: FloatArray, count: int) -> NDArray[np.int64]:
    """Indices (min(count, N),) of a well-spread subset of `points` (N, 3).

    It begins with the first point; each further one is the farthest from all before it.
    """
    if count >= len(points):
        return np.arange(len(points))
    p = points - points.mean(axis=0)
    squared, ones = np.einsum("ij,ij->i", p, p)[:, None], np.ones((len(p), 1))
    # |p - c|^2 = (p, |p|^2, 1) . (-2 c, 1, |c|^2): one product per chosen point.
    lifted = np.asfortranarray(np.hstack([p, squared, ones]))
    centres = np.hstack([-2 * p, ones, squared])
    distance, to_newest = np.full(len(p), np.inf), np.empty(len(p))
    chosen = np.zeros(count, dtype=np.int64)
    for i in range(1, count):
        newest = chosen[i - 1]
        np.dot(lifted, centres[newest], out=to_newest)
        np.minimum(distance, to_newest, out=distance)
        distance[newest] = -np.inf  # not again, even if all others lie on chosen ones
        chosen[i] = distance.argmax()
    return chosen


def estimate_normals(
    cloud: PointCloud, viewpoints: FloatArray, neighbours: int = 16, flat: BoolArray | None = None
) -> PointCloud:
    """The cloud with normals from the principal axes of each point's neighbours, turned to its camera.

    Args:
        cloud: the points.
        viewpoints: (C, 3) origins of the cameras, in the order that `cloud.camera` counts them.
        neighbours: how many nearest points make a tangent plane.
        flat: (N,) points known to lie in one plane with all that is around them; it is fitted once.

    Less than five points have no tangent planes: their normals point at the cameras.
    """
    normals = np.zeros_like(cloud.points)
    rough = np.arange(len(cloud)) if flat is None else np.flatnonzero(~flat)
    if flat is not None and flat.sum() >= 5:
        normals[flat] = fit_plane(cloud.points[flat])[1]
    if len(rough) >= 5:
        target = small_gicp.PointCloud(cloud.points[rough])
        # On one thread: waiting threads of its pool slow down all that comes after by more than they save.
        small_gicp.estimate_normals(target, num_neighbors=min(neighbours, len(rough)), num_threads=1)
        normals[rough] = target.normals()[:, :3]
    return facing(cloud, normals, viewpoints)


def facing(cloud: PointCloud, normals: FloatArray, viewpoints: FloatArray) -> PointCloud:
    """The cloud with normals (N, 3), turned to its cameras; those of no length point at them.

    Args:
        cloud: the points.
        normals: (N, 3) of length 1 or 0.
        viewpoints: (C, 3) origins of the cameras, in the order that `cloud.camera` counts them.
    """
    to_camera = viewpoints[cloud.camera] - cloud.points
    along = np.einsum("ij,ij->i", normals, to_camera)
    turned = np.where(along < 0, -1.0, 1.0)[:, None] * normals
    undefined = np.flatnonzero(se3.lengths(normals) < 0.5)
    turned[undefined] = to_camera[undefined] / np.maximum(se3.lengths(to_camera[undefined]), 1e-12)[:, None]
    return replace(cloud, normals=turned)


def fit_plane(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(3,) mean and (3,) unit normal of the plane nearest to points (N, 3), N > 2, by least squares."""
    center = points.mean(axis=0)
    offset = points - center
    return center, np.linalg.eigh(offset.T @ offset)[1][:, 0]


def middle(points: FloatArray) -> FloatArray:
    """Centre of the bounding box: which side was seen shifts it less than the mean."""
    center: FloatArray = (points.min(axis=0) + points.max(axis=0)) / 2
    return center
