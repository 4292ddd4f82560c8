"""Which turns of an object cannot be seen, and which objects look the same; read from the simulated shapes.

Symmetries are measured, not declared: the surface of an object is turned about the upright axis through its
middle and compared with itself, colours included. Things that are joined (a lever on its faucet) are judged
whole.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from imop.extras import extra
from imop.geometry import se3
from imop.geometry.neighbours import within
from imop.sim.world import World
from imop.types import BoolArray, FloatArray

with extra("sim"):
    import mujoco

TOLERANCE = 0.002
"""Metres that surfaces may differ by and still look the same."""
COLOR_TOLERANCE = 0.05
FINE_TURNS = 360
"""Turns that stand for all turns of a surface of revolution."""
ORDERS = (8, 6, 5, 4, 3, 2)
_POINTS, _PROBES = 60_000, 6_000
_OFF_AXIS = 0.001
"""Metres."""
_STRAY = 0.003
"""Share of points that may lie off the other surface: of so many random points, some have no neighbour."""


@dataclass(frozen=True, eq=False)
class _Surface:
    """Random points (N, 3), their colours (N, 3), and how far apart neighbours are, metres."""

    points: FloatArray
    colors: FloatArray
    spacing: float

    def moved(self, T: FloatArray) -> "_Surface":
        return _Surface(se3.apply(T, self.points), self.colors, self.spacing)


class Appearance:
    """What the bodies of a scene look like.

    Args:
        world: the bodies, upright; joints stand where they do in all questions.
    """

    def __init__(self, world: World):
        self._world = world
        self.turns = cache(self._turns)
        self.alike = cache(self._alike)

    def instance(self, body: str) -> str:
        """Name of the instance that cameras see the body as part of."""
        name: str = self._world.instance_names[int(self._world.instances[self._world.model.body(body).id])]
        return name

    def _turns(self, body: str) -> FloatArray:
        """(S, 4, 4) turns of the body's frame that cannot be seen, the identity first."""
        surface = self._surface(body, self._whole(body))
        up = self._world.pose(body)[2, :3]
        middle = surface.points.mean(axis=0) if len(surface.points) else np.zeros(3)
        # Frames mostly lie on the axis; what a random sample says of it is not as exact.
        middle = middle if np.linalg.norm(middle - up * (up @ middle)) > _OFF_AXIS else np.zeros(3)

        def turn(angle: float) -> FloatArray:
            R = Rotation.from_rotvec(angle * up).as_matrix()
            return se3.make(R, middle - R @ middle)

        def unseen(angle: float) -> bool:
            return _lies_on(surface.moved(turn(angle)), surface)

        # One radian is no fraction of a full turn: what it maps onto itself, any turn does.
        symmetric = (n for n in ORDERS if unseen(2 * np.pi / n))
        order = FINE_TURNS if unseen(1.0) else next(symmetric, 1)
        return np.stack([turn(2 * np.pi * k / order) for k in range(order)])

    def _alike(self, body: str, other: str) -> bool:
        """Whether two bodies, each with what is one instance with it, look the same in their frames."""
        model, instances = self._world.model, self._world.instances
        here, there = (self._surface(b, instances == instances[model.body(b).id]) for b in (body, other))
        return _lies_on(here, there) and _lies_on(there, here)

    def _whole(self, body: str) -> BoolArray:
        """(bodies,) which of them are joined with a body, but for what only hangs on the same unseen base."""
        model, instances = self._world.model, self._world.instances
        drawn = model.geom_bodyid[self._visible()]
        seen, parents = np.unique(instances[drawn]), model.body_parentid
        top = int(model.body(body).id)
        while parents[top] and instances[parents[top]] in seen:
            top = int(parents[top])
        whole = np.arange(model.nbody) == top
        for number in range(top + 1, model.nbody):
            whole[number] |= whole[parents[number]]
        return np.asarray(whole)

    def _visible(self) -> BoolArray:
        model = self._world.model
        return np.asarray((model.geom_rgba[:, 3] > 0) & (model.geom_group < 3))

    def _surface(self, body: str, bodies: BoolArray) -> _Surface:
        """What can be seen of some bodies (a mask), in the frame of `body`."""
        model, data = self._world.model, self._world.data
        geoms = np.flatnonzero(bodies[model.geom_bodyid] & self._visible())
        rng = np.random.default_rng(0)
        triangles = [_triangles(model, int(geom)) for geom in geoms]
        areas = [float(_areas(t).sum()) for t in triangles]
        points, colors = [np.zeros((0, 3))], [np.zeros((0, 3))]
        for geom, t, area in zip(geoms, triangles, areas, strict=True):
            count = int(np.ceil(_POINTS * area / sum(areas)))
            T_world_geom = se3.make(data.geom_xmat[geom].reshape(3, 3), data.geom_xpos[geom])
            points.append(se3.apply(T_world_geom, _scattered(t, count, rng)))
            colors.append(np.tile(model.geom_rgba[geom, :3].astype(np.float64), (count, 1)))
        T_body_world = se3.invert(self._world.pose(body))
        spacing = float(np.sqrt(sum(areas) / _POINTS))
        return _Surface(se3.apply(T_body_world, np.concatenate(points)), np.concatenate(colors), spacing)


def _lies_on(surface: _Surface, other: _Surface) -> bool:
    """Whether a surface is everywhere near the other one and has its colour there."""
    if not len(surface.points) or not len(other.points):
        return False
    shuffled = np.random.default_rng(0).permutation(len(surface.points))
    few = (shuffled[:300], shuffled[:_PROBES])
    return all(_off(surface, which, other).sum() <= max(2, _STRAY * len(which)) for which in few)


def _off(surface: _Surface, which: NDArray[np.int64], other: _Surface) -> BoolArray:
    """For the points `which`: True where the other surface has no point of their colour nearby."""
    points, colors = surface.points[which], surface.colors[which]
    reach = max(TOLERANCE, 3 * other.spacing)
    off = np.ones(len(points), dtype=bool)
    for color in np.unique(colors, axis=0):
        mine = np.all(colors == color, axis=1)
        equal = np.abs(other.colors - color).max(axis=1) < COLOR_TOLERANCE
        off[mine] = ~within(points[mine], other.points[equal], reach)
    return off


def _triangles(model: mujoco.MjModel, geom: int) -> FloatArray:
    """(F, 3, 3) corners of a geom's surface in its own frame."""
    kind, size = mujoco.mjtGeom(model.geom_type[geom]), model.geom_size[geom]
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = int(model.geom_dataid[geom])
        first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
        face, faces = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
        vertices = model.mesh_vert[first : first + count].astype(np.float64)
        return np.asarray(vertices[model.mesh_face[face : face + faces]])
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        return _lattice(np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0]]) * size[:2], size[2])
    angles = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    if kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        return _lattice(size[0] * np.stack([np.cos(angles), np.sin(angles)], axis=1), size[1])
    # Spheres, ellipsoids and capsules: latitudes of a unit sphere, drawn apart for a capsule.
    semi = size if kind == mujoco.mjtGeom.mjGEOM_ELLIPSOID else np.full(3, size[0])
    apart = size[1] if kind == mujoco.mjtGeom.mjGEOM_CAPSULE else 0.0
    rows = np.linspace(-np.pi / 2, np.pi / 2, 26)
    unit = np.array(
        [[(np.cos(b) * np.cos(a), np.cos(b) * np.sin(a), np.sin(b)) for a in angles] for b in rows]
    )
    grid = unit * semi + np.sign(rows)[:, None, None] * np.array([0.0, 0.0, apart])
    return _quads(grid)


def _lattice(outline: FloatArray, half: float) -> FloatArray:
    """Triangles of the upright prism over a convex outline (N, 2)."""
    middle = np.zeros_like(outline)
    heights = ((middle, -half), (outline, -half), (outline, half), (middle, half))
    return _quads(np.stack([np.column_stack([xy, np.full(len(xy), z)]) for xy, z in heights]))


def _quads(grid: FloatArray) -> FloatArray:
    """(F, 3, 3) triangles of a grid (rows, columns, 3) that is closed along its columns."""
    a, b = grid[:-1], grid[1:]
    c, d = np.roll(a, -1, axis=1), np.roll(b, -1, axis=1)
    return np.concatenate([np.stack([a, b, c], axis=2), np.stack([b, d, c], axis=2)]).reshape(-1, 3, 3)


def _areas(triangles: FloatArray) -> FloatArray:
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    return np.asarray(np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2)


def _scattered(triangles: FloatArray, count: int, rng: np.random.Generator) -> FloatArray:
    """(count, 3) points spread evenly over triangles."""
    areas = _areas(triangles)
    t = triangles[rng.choice(len(triangles), count, p=areas / areas.sum())]
    u, v = rng.random((2, count, 1))
    over = u + v > 1
    u, v = np.where(over, 1 - u, u), np.where(over, 1 - v, v)
    return np.asarray(t[:, 0] + u * (t[:, 1] - t[:, 0]) + v * (t[:, 2] - t[:, 0]))
