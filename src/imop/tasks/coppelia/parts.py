"""Convex parts of meshes that are not convex: MuJoCo bumps into hulls, which fill slots and holes.

Taking a mesh apart takes seconds to a minute, so the parts are kept in the user's folder for caches, by the
mesh's contents.
"""

import hashlib
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from imop.errors import MissingExtra
from imop.files import replaced, user_cache
from imop.tasks.coppelia.model import Model, Piece, Shape
from imop.types import FloatArray

_CONVEX = 0.95
"""Share of its hull that a convex mesh fills, at least."""
_GRID = 1e-6
"""Vertices that are nearer to each other count as one, metres."""
_CONCAVITY, _MOST_PARTS = 0.05, 64
_SEARCH = {"mcts_nodes": 10, "mcts_iterations": 60, "mcts_max_depth": 2, "resolution": 1000}


def is_convex(piece: Piece) -> bool:
    """Whether a piece fills most of its hull, or is flat."""
    if piece.convex or piece.primitive not in (None, "heightfield"):
        return True
    points = piece.vertices.astype(np.float64)
    try:
        hull = ConvexHull(points).volume
    except (QhullError, ValueError):
        return True
    a, b, c = np.moveaxis((points - points.mean(axis=0))[piece.triangles], 1, 0)
    return abs(float(np.einsum("ti,ti->", a, np.cross(b, c)))) / 6 > _CONVEX * hull


def filled(model: Model) -> list[str]:
    """Names of the shapes that others bump into and that are not convex, so that hulls would fill them."""
    solid = (o for o in model.objects if isinstance(o, Shape) and o.respondable)
    return [o.name for o in solid if not all(is_convex(piece) for piece in o.pieces)]


def convex_parts(piece: Piece, folder: Path | None = None) -> list[FloatArray]:
    """Corners (n, 3) of convex parts that fill a piece, in its frame; made only once.

    Args:
        piece: a mesh that is not convex.
        folder: of the cache; `user_cache()/parts` if None.

    Raises:
        MissingExtra: if they are not kept and coacd is not installed.
    """
    digest = hashlib.sha256(piece.vertices.tobytes() + piece.triangles.tobytes()).hexdigest()
    kept = (folder or user_cache() / "parts") / f"{digest}.npz"
    try:
        with np.load(kept) as stored:
            return [stored[name].astype(np.float64).reshape(-1, 3) for name in stored.files]
    except (OSError, ValueError, EOFError, BadZipFile):  # not there, or spoilt: made again
        parts = _taken_apart(piece)
    try:
        with replaced(kept) as temporary, temporary.open("wb") as file:
            np.savez(file, *parts)
    except OSError:  # a folder that cannot be written only costs time
        pass
    return parts


def _taken_apart(piece: Piece) -> list[FloatArray]:
    try:
        import coacd
    except ImportError as error:
        raise MissingExtra("coacd", "sim") from error
    coacd.set_log_level("error")
    on_grid = np.round(piece.vertices.astype(np.float64) / _GRID) * _GRID
    points, number = np.unique(on_grid, axis=0, return_inverse=True)
    triangles = number.reshape(-1)[piece.triangles]
    found = coacd.run_coacd(
        coacd.Mesh(points, triangles),
        threshold=_CONCAVITY,
        max_convex_hull=_MOST_PARTS,
        seed=0,
        **_SEARCH,
    )
    return [np.asarray(corners, dtype=np.float64) for corners, _ in found]
