"""Do the views of one scene agree, and if not, which camera is wrong and how?

Two views contradict each other where one saw a surface at a place through which the other one looked. Unlike
a distance between their clouds this does not mind what one sees and the other cannot: in real demonstrations
of RLBench 0.1 % of the pixels contradict, and 4 % if one camera is displaced by 2 cm.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, permutations

import numpy as np
from scipy.ndimage import maximum_filter, minimum_filter
from scipy.spatial.transform import Rotation

from imop.geometry import se3
from imop.geometry.cloud import flying_pixels, unproject
from imop.types import CameraView, FloatArray

Views = Mapping[str, CameraView]
Pair = tuple[str, str]
Change = Callable[[CameraView], CameraView]

TOLERANCE = 0.02
ACCEPTED = 0.02
ENOUGH_PIXELS = 300


@dataclass(frozen=True)
class Disagreement:
    """Cameras that contradict the others.

    Attributes:
        cameras: which; all of them if there is no telling.
        contradicting: fraction of the pixels that see the same place; None if no other camera sees it.
        cure: the change after which the views agree, in words; None if none was found.
    """

    cameras: tuple[str, ...]
    contradicting: float | None
    cure: str | None


def find_disagreement(observations: Sequence[Views]) -> list[Disagreement]:
    """Which cameras contradict the others over all `observations`, and what would make them agree."""
    fractions = contradictions(observations)
    offenders = _offenders(fractions, observations)
    if not offenders:
        return []
    shown = observations[:: max(1, len(observations) - 1)]  # the first and the last are enough to search with
    everywhere = sorted({camera for views in observations for camera in views})
    common = _cure(shown, everywhere, [])
    if common is not None:
        return [Disagreement(tuple(everywhere), max(offenders.values(), key=lambda f: f or 0.0), common)]
    if len(everywhere) == 2:
        cures = [f"{camera}: {cure}" for camera in everywhere if (cure := _cure(shown, [camera], []))]
        return [Disagreement(tuple(everywhere), next(iter(offenders.values())), " or ".join(cures) or None)]
    return [
        Disagreement((camera,), fraction, _cure(shown, [camera], [o for o in offenders if o != camera]))
        for camera, fraction in offenders.items()
    ]


def contradictions(observations: Sequence[Views], stride: int = 1) -> dict[Pair, float]:
    """For every two cameras that see enough of the same scene: in which fraction of it they contradict."""
    counts: dict[Pair, FloatArray] = {}
    for views in observations:
        surfaces = {name: _surface(view, stride) for name, view in views.items()}
        limits = {name: _limits(view) for name, view in views.items()}
        for a, b in permutations(views, 2):
            pair = (a, b) if a < b else (b, a)
            counts[pair] = counts.get(pair, np.zeros(2)) + _compare(surfaces[a], views[b], limits[b])
    enough = ENOUGH_PIXELS / stride**2
    return {pair: c[0] / c.sum() for pair, c in counts.items() if c.sum() >= enough}


def reordered_quaternion(T: FloatArray) -> tuple[FloatArray, FloatArray]:
    """`T` as it would be had its quaternion been xyzw but read as wxyz, and the other way round."""
    xyzw = Rotation.from_matrix(T[:3, :3]).as_quat()
    first, second = (Rotation.from_quat(np.roll(xyzw, shift)).as_matrix() for shift in (1, -1))
    return se3.make(first, T[:3, 3]), se3.make(second, T[:3, 3])


def _surface(view: CameraView, stride: int) -> FloatArray:
    keep = view.measured & ~flying_pixels(view)
    return unproject(view)[::stride, ::stride][keep[::stride, ::stride]]


def _limits(view: CameraView) -> tuple[FloatArray, FloatArray]:
    """Nearest and farthest depth around every pixel; 0 and infinity beside pixels without a measurement."""
    near = minimum_filter(np.where(view.measured, view.depth, 0.0), 3)
    return near, maximum_filter(np.where(view.measured, view.depth, np.inf), 3)


def _compare(p_world: FloatArray, view: CameraView, limits: tuple[FloatArray, FloatArray]) -> FloatArray:
    """(2,) how many pixels of `view` contradict the points, and how many confirm them."""
    near, far = limits
    height, width = near.shape
    p = se3.apply(se3.invert(view.T_world_camera), p_world)
    p = p[p[:, 2] > TOLERANCE]
    u, v = np.rint((p @ view.intrinsics.T)[:, :2] / p[:, 2:]).T
    inside = (u >= 0) & (u < width) & (v >= 0) & (v < height)
    pixels = (v[inside] * width + u[inside]).astype(np.int64)
    z = p[inside, 2]
    before = z < near.ravel()[pixels] - TOLERANCE
    behind = z > far.ravel()[pixels] + TOLERANCE
    # Pixels are counted, not points: a near camera sees thousands of points where a far one has one pixel.
    confirmed = np.unique(pixels[~before & ~behind])
    contradicted = np.setdiff1d(pixels[before], confirmed)
    return np.array([len(contradicted), len(confirmed)], dtype=np.float64)


def _offenders(fractions: dict[Pair, float], observations: Sequence[Views]) -> dict[str, float | None]:
    """The fewest cameras without which all others agree, worst first."""
    cameras = sorted({camera for views in observations for camera in views})
    offenders: dict[str, float | None] = {}
    bad = {pair: fraction for pair, fraction in fractions.items() if fraction > ACCEPTED}
    while bad:
        blame = {c: (sum(c in p for p in bad), sum(f for p, f in bad.items() if c in p)) for c in cameras}
        worst = max(blame, key=lambda c: blame[c])
        offenders[worst] = max(f for pair, f in bad.items() if worst in pair)
        bad = {pair: fraction for pair, fraction in bad.items() if worst not in pair}
    if len(cameras) > 1:
        for camera in cameras:
            if not any(camera in pair for pair in fractions):
                offenders[camera] = None
    return offenders


def _cure(observations: Sequence[Views], cameras: Sequence[str], ignored: Sequence[str]) -> str | None:
    """The change of `cameras` after which they agree with all but the `ignored` ones, or None."""
    seen = [{n: v for n, v in views.items() if n not in ignored} for views in observations]
    others = {n for views in seen for n in views} - set(cameras)

    def cost(change: Change) -> float:
        changed = [{n: change(v) if n in cameras else v for n, v in views.items()} for views in seen]
        fractions = contradictions(changed, stride=2)
        pairs = [p for p in combinations(sorted({*cameras, *others}), 2) if set(p) & set(cameras)]
        known = [fractions[p] for p in pairs if p in fractions]
        return max(known) + 1e-3 * (len(pairs) - len(known)) if known else 1.0

    candidates = [(cost(change), words) for words, change in _changes_of_pose()]
    scale = _best_scale(lambda s: cost(lambda v: replace(v, depth=v.depth * np.float32(s))))
    if abs(scale - 1) > 0.01:
        words = f"its depth is multiplied by {scale:.3g}"
        candidates.append((cost(lambda v: replace(v, depth=v.depth * np.float32(scale))), words))
    best, words = min(candidates)
    return words if best < ACCEPTED else None


def _changes_of_pose() -> Iterator[tuple[str, Change]]:
    def pose(change: Callable[[FloatArray], FloatArray]) -> Change:
        return lambda view: replace(view, T_world_camera=change(view.T_world_camera))

    yield "its pose is inverted (T_camera_world was given for T_world_camera)", pose(se3.invert)
    opengl = np.diag([1.0, -1.0, -1.0, 1.0])
    yield (
        "its axes are turned from OpenGL's (y up) to OpenCV's (y down, z forward)",
        pose(lambda T: T @ opengl),
    )
    words = "the quaternion of its pose is read in the order {} instead of {}"
    yield words.format("xyzw", "wxyz"), pose(lambda T: reordered_quaternion(T)[0])
    yield words.format("wxyz", "xyzw"), pose(lambda T: reordered_quaternion(T)[1])


def _best_scale(cost: Callable[[float], float]) -> float:
    """Where `cost` is least, by a grid refined twice, because it is one narrow valley between plateaus."""
    best = 1.0
    for step, count in ((1.06, 16), (1.01, 6), (1.0025, 4)):
        best = min((best * step**k for k in range(-count, count + 1)), key=cost)
    return best
