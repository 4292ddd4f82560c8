"""Do the views of one scene agree, and if not, which camera is wrong and how?

Two views contradict each other where one saw a surface at a place through which the other one looked. Unlike
a distance between their clouds this does not mind what one sees and the other cannot. The table does not
count as agreement, because a camera that slides along it still sees it in the right place.
"""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import astuple, dataclass, replace
from itertools import permutations

import numpy as np
from scipy.ndimage import maximum_filter, minimum_filter
from scipy.spatial.transform import Rotation

from imop.geometry import se3
from imop.geometry.cloud import flying_pixels
from imop.types import BoolArray, CameraView, FloatArray

Views = Mapping[str, CameraView]
Pair = tuple[str, str]

TOLERANCE = 0.02
# Standard deviation of measured depth z is this times z^2 (Khoshelham and Elberink 2012: Kinect, 2.85 mm at
# 1 m). It exceeds the tolerance from 1.3 m on, where a camera displaced by a centimetre cannot be told.
AXIAL_NOISE = 2.85e-3
DEVIATIONS = 3.0
# Good demonstrations of RLBench stay below 1.5 %, such with a Kinect's noise and poses wrong by 3 mm and 0.25
# degrees below 2.2 %; one camera displaced by 2 cm gives 5 % and more.
ACCEPTED = 0.025
# Fractions of the images: what two cameras must see together to be compared, and to be called in agreement.
ENOUGH = 0.002
OVERLAP = 0.03
# Smaller changes of all depths, and of those of one camera, are not told from displaced cameras.
SMALLEST_RESCALING = (0.03, 0.05)
# Every how many points are enough to search for a cure.
THINNED = 5


@dataclass(frozen=True)
class Disagreement:
    """Cameras that contradict the others.

    Attributes:
        cameras: which; all of them if there is no telling.
        contradicting: fraction of what both see, in the worst pair; None if no other camera sees the same.
        cure: the change after which the views agree, in words; None if none was found.
    """

    cameras: tuple[str, ...]
    contradicting: float | None
    cure: str | None


@dataclass(frozen=True)
class _Seen:
    """What is compared of a view: points, nearest and farthest depth around each pixel, and noise of both."""

    p_camera: FloatArray
    noise_of_points: FloatArray
    near: FloatArray
    far: FloatArray
    noise: FloatArray
    intrinsics: FloatArray
    T_world_camera: FloatArray


@dataclass(frozen=True)
class _Counts:
    """Pixels of two cameras: how many contradict, confirm, confirm something else than the table, exist."""

    contradicted: int = 0
    confirmed: int = 0
    confirmed_things: int = 0
    pixels: int = 0

    def __add__(self, other: "_Counts") -> "_Counts":
        return _Counts(*(a + b for a, b in zip(astuple(self), astuple(other), strict=True)))

    @property
    def fraction(self) -> float | None:
        seen = self.contradicted + self.confirmed_things
        return self.contradicted / seen if seen >= ENOUGH * self.pixels else None


_Change = Callable[[_Seen], _Seen]
_Scenes = Sequence[Mapping[str, _Seen]]


def contradictions(observations: Sequence[Views]) -> dict[Pair, float]:
    """For every two cameras that see enough of the same things: in which fraction of them they contradict."""
    counts = _count(_scenes(observations))
    return {pair: c.fraction for pair, c in counts.items() if c.fraction is not None}


def find_disagreement(observations: Sequence[Views]) -> list[Disagreement]:
    """Which cameras contradict the others over all `observations`, and what would make them agree."""
    offenders = _offenders(_count(_scenes(observations)))
    if not offenders:
        return []
    shown = _scenes([observations[0], observations[-1]], THINNED)
    cameras = sorted({camera for scene in shown for camera in scene})
    worst = next(iter(offenders.values()))
    alone = [_cure_of_one(shown, camera, offenders) for camera in offenders]
    # One camera is wrong more often than all; but if all are, any of them can look like the only one.
    if len(offenders) > 1 or len(cameras) == 2 or alone == [None]:
        common = _cure(shown, cameras)
        if common is not None:
            return [Disagreement(tuple(cameras), worst, common)]
    if len(cameras) == 2:
        cures = [f"{camera}: {cure}" for camera in cameras if (cure := _cure(shown, [camera]))]
        return [Disagreement(tuple(cameras), worst, " or ".join(cures) or None)]
    return [
        Disagreement((camera,), fraction, cure)
        for (camera, fraction), cure in zip(offenders.items(), alone, strict=True)
    ]


def _cure_of_one(scenes: _Scenes, camera: str, offenders: Collection[str]) -> str | None:
    """What makes `camera` agree with those that are beyond suspicion."""
    trusted = [{n: v for n, v in s.items() if n == camera or n not in offenders} for s in scenes]
    return _cure(trusted, [camera])


def reordered_quaternion(T: FloatArray) -> tuple[FloatArray, FloatArray]:
    """`T` as it would be had its quaternion been xyzw but read as wxyz, and the other way round."""
    xyzw = Rotation.from_matrix(T[:3, :3]).as_quat()
    first, second = (Rotation.from_quat(np.roll(xyzw, shift)).as_matrix() for shift in (1, -1))
    return se3.make(first, T[:3, 3]), se3.make(second, T[:3, 3])


def _scenes(observations: Sequence[Views], thinned: int = 1) -> _Scenes:
    return [{name: _seen(view, thinned) for name, view in views.items()} for views in observations]


def _seen(view: CameraView, thinned: int) -> _Seen:
    v, u = (index[::thinned] for index in np.nonzero(view.measured & ~flying_pixels(view)))
    depth = view.depth[v, u].astype(np.float64)
    p_camera = np.stack([u * depth, v * depth, depth], axis=-1) @ np.linalg.inv(view.intrinsics).T
    # Nothing contradicts or is hidden beside pixels without a measurement.
    near = minimum_filter(np.where(view.measured, view.depth, 0.0).astype(np.float64), 3)
    far = maximum_filter(np.where(view.measured, view.depth, np.inf).astype(np.float64), 3)
    noise_of_points, noise = AXIAL_NOISE * depth**2, AXIAL_NOISE * near**2
    return _Seen(p_camera, noise_of_points, near, far, noise, view.intrinsics, view.T_world_camera)


def _tolerance(noise: FloatArray) -> FloatArray:
    """How far apart what is one surface may have been measured, metres."""
    return np.maximum(TOLERANCE, DEVIATIONS * noise)


def _count(scenes: _Scenes, thinned: int = 1) -> dict[Pair, _Counts]:
    counts: dict[Pair, _Counts] = {}
    for scene in scenes:
        p_world = {name: se3.apply(seen.T_world_camera, seen.p_camera) for name, seen in scene.items()}
        table = _table_height(np.concatenate([np.empty((0, 3)), *p_world.values()]))
        for a, b in permutations(scene, 2):
            pair = (a, b) if a < b else (b, a)
            noise = scene[a].noise_of_points
            is_thing = np.abs(p_world[a][:, 2] - table) > _tolerance(noise)
            found = _compare(p_world[a], noise, is_thing, scene[b], thinned)
            counts[pair] = counts.get(pair, _Counts()) + found
    return counts


def _table_height(p_world: FloatArray) -> float:
    """The height at which most points lie."""
    if not len(p_world):
        return np.inf
    slices, counts = np.unique(np.floor(p_world[:, 2] / 0.01), return_counts=True)
    return float((slices[counts.argmax()] + 0.5) * 0.01)


def _compare(
    p_world: FloatArray, noise: FloatArray, is_thing: BoolArray, seen: _Seen, thinned: int
) -> _Counts:
    height, width = seen.near.shape
    p = se3.apply(se3.invert(seen.T_world_camera), p_world)
    in_front = np.flatnonzero(p[:, 2] > TOLERANCE)
    u, v = np.rint((p[in_front] @ seen.intrinsics.T)[:, :2] / p[in_front, 2:]).T
    inside = (u >= 0) & (u < width) & (v >= 0) & (v < height)
    pixels = (v[inside] * width + u[inside]).astype(np.int64)
    kept = in_front[inside]
    z, is_thing = p[kept, 2], is_thing[kept]
    tolerance = _tolerance(np.hypot(noise[kept], seen.noise.ravel()[pixels]))
    before = z < seen.near.ravel()[pixels] - tolerance
    fits = ~before & (z <= seen.far.ravel()[pixels] + tolerance)
    # Pixels are counted, not points: a near camera sees thousands of points where a far one has one pixel.
    confirmed = np.unique(pixels[fits])
    contradicted = np.setdiff1d(pixels[before], confirmed)
    things = np.unique(pixels[fits & is_thing])
    return _Counts(len(contradicted), len(confirmed), len(things), seen.near.size // thinned)


def _offenders(counts: Mapping[Pair, _Counts]) -> dict[str, float | None]:
    """The fewest cameras without which all others agree, worst first, and how much they contradict."""
    cameras = sorted({camera for pair in counts for camera in pair})
    fractions = {pair: c.fraction for pair, c in counts.items() if c.fraction is not None}
    offenders: dict[str, float | None] = {}
    bad = {pair: fraction for pair, fraction in fractions.items() if fraction > ACCEPTED}
    while bad:
        blame = {c: (sum(c in p for p in bad), sum(f for p, f in bad.items() if c in p)) for c in cameras}
        worst = max(blame, key=lambda c: blame[c])
        offenders[worst] = max(f for pair, f in bad.items() if worst in pair)
        bad = {pair: fraction for pair, fraction in bad.items() if worst not in pair}
    return offenders | {c: None for c in cameras if not any(c in pair for pair in fractions)}


def _cure(scenes: _Scenes, cameras: Sequence[str]) -> str | None:
    """The change of `cameras` after which all cameras of the (thinned) `scenes` agree, or None."""

    def after(change: _Change) -> dict[Pair, _Counts]:
        changed = [{n: change(v) if n in cameras else v for n, v in scene.items()} for scene in scenes]
        return _count(changed, THINNED)

    def score(change: _Change) -> int:
        return sum(c.confirmed - c.contradicted for c in after(change).values())

    scale = _best_scale(lambda factor: score(_rescaled(factor)))
    candidates = list(_changes_of_pose())
    # Within the tolerance a little more or less depth also hides a small displacement.
    if abs(scale - 1) > SMALLEST_RESCALING[len(cameras) == 1]:
        candidates.append((f"its depth is multiplied by {scale:.3g}", _rescaled(scale)))
    words, change = max(candidates, key=lambda candidate: score(candidate[1]))
    cured = after(change)
    # Views that hardly see the same contradict each other little, too.
    overlap = max((c.confirmed / c.pixels for c in cured.values()), default=0.0)
    better = score(change) > score(lambda seen: seen)
    return words if better and overlap > OVERLAP and not _offenders(cured) else None


def _rescaled(factor: float) -> _Change:
    return lambda seen: replace(
        seen, p_camera=seen.p_camera * factor, near=seen.near * factor, far=seen.far * factor
    )


def _changes_of_pose() -> Iterator[tuple[str, _Change]]:
    def pose(change: Callable[[FloatArray], FloatArray]) -> _Change:
        return lambda seen: replace(seen, T_world_camera=change(seen.T_world_camera))

    yield "its pose is inverted (T_camera_world was given for T_world_camera)", pose(se3.invert)
    opengl = np.diag([1.0, -1.0, -1.0, 1.0])
    words = "its axes are turned from OpenGL's (y up) to OpenCV's (y down, z forward)"
    yield words, pose(lambda T: T @ opengl)
    words = "the quaternion of its pose is read in the order {} instead of {}"
    yield words.format("xyzw", "wxyz"), pose(lambda T: reordered_quaternion(T)[0])
    yield words.format("wxyz", "xyzw"), pose(lambda T: reordered_quaternion(T)[1])


def _best_scale(score: Callable[[float], int]) -> float:
    """Where `score` is greatest, by a grid refined twice, because it is one narrow peak on a plain."""
    best = 1.0
    for step, count in ((1.06, 16), (1.01, 6), (1.0025, 4)):
        best = max((best * step**k for k in range(-count, count + 1)), key=score)
    return best
