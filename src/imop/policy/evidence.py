"""What speaks for a motion of a region: how it explains what the cameras saw, point by point, in numbers.

Forward, the observed points have to explain the moved region; backward, the region has to explain what was
observed around it, which tells a thing from a larger one and a front with handles from a back. Nothing is
decided here: `networks/verification.py` learns how much each number counts.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from imop.geometry import se3
from imop.geometry.cloud import PointCloud, concatenate, farthest_points, inside_box
from imop.geometry.neighbours import within
from imop.geometry.primitives import PARALLEL_GRIPPER
from imop.policy.contacts import SAME
from imop.policy.interfaces import PolicyConfig
from imop.policy.region import Goal, Region, fading
from imop.policy.target import BESIDE, OFFSET, SHADE, Explained, Surface, shades
from imop.types import CameraView, Float32Array, FloatArray

# Observed points this near to the moved region, metres, have to be explained by it.
AROUND = 0.04
# Colours that agree less than this contradict each other. What their pattern explains is told from noise of
# this variance. Marks that vary less than this are taken to have kept their colours.
CLASH, NOISE, FAINT = 0.1, 0.02, 0.01


class Template:
    """A region ready to be compared with any scene.

    Args:
        region: of a step.
        p_goal: (3,) where the action takes the tip.
        beside: what stands around there in the demonstrated scene, with normals; at least one point.
        views: of the demonstrated scene.
        config: says how many points are compared.
        payload: what the hand takes next, if that is less than the region.
        goal: what stands where the action goes, if that is not the region.
        others: (N, 3) colours of all else that stands in the demonstrated scene.

    Attributes:
        cloud: points of the region, `size` of them, then of its context, then of the goal.
        glance: those that are compared at a glance.
        backward: how many observed points are compared with the region.
        hue, spread: (M, 4) shades and (M,) spread of them.
        weights: (M, 6) of the region, near the gripper, of what stays in place, of what is taken, of the
            goal, of the context.
        marks: variance of the region's shades.
        center: (3,) mean of the region's points.
    """

    def __init__(
        self,
        region: Region,
        p_goal: FloatArray,
        beside: PointCloud,
        views: Sequence[CameraView],
        config: PolicyConfig,
        payload: PointCloud | None = None,
        goal: Goal | None = None,
        others: Float32Array | None = None,
    ) -> None:
        own, few, self.backward = config.compared
        chosen = farthest_points(region.cloud.points, own)
        parts = [region.cloud.select(chosen)]
        weights = [_weights(region, chosen, p_goal, payload, goal is None)]
        looks = [np.arange(len(chosen)) < config.glanced[0]]
        for column, cloud, weight in _beyond(region, goal):
            some = farthest_points(cloud.points, few)
            parts.append(cloud.select(some))
            weights.append(weight[some, None] * np.eye(6)[column])
            looks.append(np.arange(len(some)) < config.glanced[1])
        self.cloud, self.weights = concatenate(parts), np.concatenate(weights)
        self.hue = shades(self.cloud.colors)
        self.spread = np.full(len(self.cloud), OFFSET)
        self.spread[: len(chosen)] = region.spreads[chosen]
        self.size, self.marks = len(chosen), float(self.hue[: len(chosen)].var(axis=0).sum())
        self.glance = np.flatnonzero(np.concatenate(looks))
        self.whole, self.beside = Surface(region.whole, views), Surface(beside, views)
        self.center = np.asarray(region.cloud.points.mean(axis=0))
        self.p_goal, self._hues = p_goal, cKDTree(self.hue[: self.size])
        self._others: cKDTree | None = None
        if others is not None and len(others):
            self._others = cKDTree(shades(others[:: max(1, len(others) // own)]))

    def claimed(self, found: FloatArray) -> FloatArray:
        """(...,) by how much shades (..., 4) look more like something else that was shown, 0 .. 1."""
        if self._others is None:
            return np.zeros(found.shape[:-1])
        other, own = (_alike(tree, found) for tree in (self._others, self._hues))
        return np.asarray(np.maximum(other - own, 0.0))

    def moved(self, T: FloatArray, which: NDArray[np.int64]) -> tuple[FloatArray, FloatArray]:
        """Points (H * M, 3) and normals after each of motions (H, 4, 4), one after the other."""
        assert self.cloud.normals is not None
        points = se3.apply(T, self.cloud.points[which]).reshape(-1, 3)
        return points, se3.rotate(T, self.cloud.normals[which]).reshape(-1, 3)


def _beyond(region: Region, goal: Goal | None) -> Iterator[tuple[int, PointCloud, FloatArray]]:
    """What is not of the region and compared all the same: column and cloud, with weights (N,)."""
    if region.context is not None:
        yield 5, region.context, np.ones(len(region.context))
    if goal is not None:
        yield 4, goal.cloud, goal.weight


def _weights(
    region: Region, chosen: NDArray[np.int64], p_goal: FloatArray, payload: PointCloud | None, at_goal: bool
) -> FloatArray:
    """(M, 6) `Template.weights` of points of the region.

    If all of the region is taken, or none, what is near the gripper stands for it; so it does for the goal,
    if the region is `at_goal`.
    """
    weight = region.weight[chosen]
    near = weight * fading(np.linalg.norm(region.cloud.points[chosen] - p_goal, axis=1))
    firm = weight * region.trust[chosen]
    taken = np.zeros(len(chosen))
    if payload is not None:
        taken = weight * within(region.cloud.points[chosen], payload.points, SAME)
    taken = taken if taken.any() else near
    return np.stack([weight, near, firm, taken, near * at_goal, np.zeros(len(chosen))], axis=1)


def glance(template: Template, surface: Surface, T: FloatArray) -> FloatArray:
    """(H, 6) quick looks at motions (H, 4, 4).

    At the region in its colours, its shape, what is near, what is firm, what is taken, and the goal.
    """
    which = template.glance
    found = surface.explain(*template.moved(T, which), *_tiled(template, which, len(T)))
    loose, color = found.loose.reshape(len(T), -1), found.color.reshape(len(T), -1)
    w = template.weights[which]
    tinted = loose * np.sqrt(color)
    values = (loose * color, loose, tinted, loose, tinted, tinted)
    columns = (w[:, 0], *w[:, :5].T)
    return np.stack(
        [(v * c).sum(1) / max(c.sum(), 1e-9) for v, c in zip(values, columns, strict=True)], axis=1
    )


def shares(template: Template, surface: Surface, T: FloatArray) -> FloatArray:
    """(H, 41) what `networks.verification.EVIDENCE` names first: forward, context, backward, around."""
    H, which = len(T), np.arange(len(template.cloud))
    points, normals = template.moved(T, which)
    found = surface.explain(points, normals, *_tiled(template, which, H))
    exact, loose, color = (v.reshape(H, -1) for v in (found.exact, found.loose, found.color))
    hidden, absent = _missing(surface, points, normals, found.loose)
    hidden, absent = hidden.reshape(H, -1), absent.reshape(H, -1)
    columns = []
    for w in template.weights[:, :5].T:
        visible = np.maximum((1 - hidden * (1 - loose)) @ w, 1e-9)
        columns += [exact @ w / visible, loose @ w / visible, *_rest(loose, color, hidden, absent, w)]
    w = template.weights[:, 5]
    all_of_it = max(w.sum(), 1e-9)
    columns += [loose @ w / all_of_it, (loose * color) @ w / np.maximum(loose @ w, 1e-9)]
    columns += [(absent * (1 - loose)) @ w / all_of_it]
    # What has no marks has no pattern either.
    telling = template.marks / (template.marks + NOISE)
    index, own = found.index.reshape(H, -1)[:, : template.size], loose[:, : template.size]
    columns += [telling * _paint(template, surface, index, own), _claimed(template, surface, index, own)]
    rows = np.stack([np.asarray(c) for c in columns], axis=1)
    backward = np.stack([_backward(template, surface, M) for M in T])
    return np.concatenate([rows, backward], axis=1)


def looks(template: Template, surface: Surface, T: FloatArray) -> FloatArray:
    """(H, 3) how motions (H, 4, 4) lay the region onto what was seen: shape, colours, and their pattern."""
    which = np.arange(template.size)
    found = surface.explain(*template.moved(T, which), *_tiled(template, which, len(T)))
    exact, loose, color = (v.reshape(len(T), -1) for v in (found.exact, found.loose, found.color))
    w = template.weights[which, 0]
    tinted = (loose * color) @ w / np.maximum(loose @ w, 1e-9)
    paint = _paint(template, surface, found.index.reshape(len(T), -1), loose)
    return np.stack([exact @ w / max(w.sum(), 1e-9), tinted, paint], axis=1)


def _paint(template: Template, surface: Surface, index: NDArray[np.int64], loose: FloatArray) -> FloatArray:
    """(H,) `pattern` of the region, whose counterparts are (H, M) and fit as well as `loose` (H, M)."""
    weight = loose * template.weights[: template.size, 0]
    return pattern(template.hue[: template.size], surface.shades[index], weight)


def _claimed(template: Template, surface: Surface, index: NDArray[np.int64], loose: FloatArray) -> FloatArray:
    """(H,) how much the counterparts look like something else that was shown; see `Template.claimed`."""
    weight = loose * template.weights[: template.size, 0]
    seen, where = np.unique(index, return_inverse=True)
    claims = template.claimed(surface.shades[seen])[where].reshape(index.shape)
    return np.asarray((claims * weight).sum(axis=1) / np.maximum(weight.sum(axis=1), 1e-9))


def palette(template: Template, surface: Surface) -> float:
    """Share 0 .. 1 of the region's colours that are somewhere in the scene, wherever that is.

    If the colours are there, a thing in other colours is probably not meant. If they are not, it may be.
    """
    there = _alike(cKDTree(surface.shades[surface.sample]), template.hue[: template.size])
    return float(np.average(there, weights=template.weights[: template.size, 0]))


def _alike(known: cKDTree, found: FloatArray) -> FloatArray:
    """(...,) 0 .. 1 agreement of shades (..., 4) with the most similar known one."""
    away = np.asarray(known.query(found)[0])
    return np.asarray(np.exp(-0.5 * (away / SHADE) ** 2))


def pattern(shown: FloatArray, found: FloatArray, weight: FloatArray) -> FloatArray:
    """(H,) share of the variance of the colours found that a linear map of the colours shown explains.

    It tells whether marks lie where they were shown, whatever their colours are now. For faint ones the map
    can hardly be known; it is taken to be about the identity, as if colours had stayed but for the light.

    Args:
        shown: (M, 4) shades of the region.
        found: (H, M, 4) shades of the counterparts.
        weight: (H, M) of the points.
    """
    w = weight / np.maximum(weight.sum(axis=1, keepdims=True), 1e-9)
    x = shown - np.einsum("hm,mi->hi", w, shown)[:, None]
    y = found - np.einsum("hm,hmk->hk", w, found)[:, None]
    prior = FAINT * np.eye(shown.shape[1])
    G = np.einsum("hm,hmi,hmj->hij", w, x, x) + prior
    B = np.linalg.solve(G, np.einsum("hm,hmi,hmk->hik", w, x, y) + prior)
    total = np.einsum("hm,hmk->h", w, y**2)
    rest = np.einsum("hm,hmk->h", w, (y - x @ B) ** 2)
    return np.asarray((total - rest) / (total + NOISE))


def _rest(
    loose: FloatArray, color: FloatArray, hidden: FloatArray, absent: FloatArray, w: FloatArray
) -> list[FloatArray]:
    got, total = np.maximum(loose @ w, 1e-9), max(float(w.sum()), 1e-9)
    return [
        (loose * color) @ w / got,
        (loose * (color < CLASH)) @ w / got,
        (hidden * (1 - loose)) @ w / total,
        (absent * (1 - loose)) @ w / total,
    ]


def _missing(
    surface: Surface, points: FloatArray, normals: FloatArray, loose: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(K,) 1 where a point that is not explained is hidden, and where it is seen through."""
    doubtful = np.flatnonzero(loose < 0.5)
    hidden, absent = np.zeros(len(points)), np.zeros(len(points))
    h, a = surface.seen(points[doubtful], normals[doubtful])
    hidden[doubtful], absent[doubtful] = h, a & ~h
    return hidden, absent


def _tiled(template: Template, which: NDArray[np.int64], copies: int) -> tuple[FloatArray, FloatArray]:
    return np.tile(template.hue[which], (copies, 1)), np.tile(template.spread[which], copies)


def _backward(template: Template, surface: Surface, T: FloatArray) -> FloatArray:
    """(6,) what the region explains of what is around it, and what is alike around the gripper."""
    whole, back = template.whole, se3.invert(T)
    points = se3.apply(back, surface.cloud.points[surface.sample])
    near = np.flatnonzero(np.isfinite(whole.tree.query(points, distance_upper_bound=AROUND)[0]))
    found = _explain(whole, surface, surface.sample[_some(near, template.backward)], back)
    got, all_of_it = max(float(found.loose.sum()), 1e-9), max(len(found.loose), 1)
    color, clash = found.loose @ found.color / got, found.loose @ (found.color < CLASH) / got
    beside = template.beside
    forward = _explain(surface, beside, np.arange(len(beside.cloud)), T).loose
    at = se3.apply(T, template.p_goal[None])[0]
    inside = np.asarray(surface.tree.query_ball_point(at, BESIDE, return_sorted=True), dtype=np.int64)
    there = _explain(beside, surface, _some(inside, template.backward), back).loose
    return np.array([got / all_of_it, color, clash, np.log1p(len(near)), forward.mean(), _mean(there)])


def crowd(points: FloatArray, T_world_gripper: FloatArray) -> FloatArray:
    """(H, 3) how many points (N, 3), on a logarithmic scale, are where wrist, palm and fingers would be.

    Args:
        points: that stand in the scene, world frame.
        T_world_gripper: (H, 4, 4).
    """
    p_gripper = se3.apply(se3.invert(T_world_gripper), points).reshape(-1, 3)
    inside = np.stack([inside_box(p_gripper, *box) for box in PARALLEL_GRIPPER], axis=1)
    counts = inside.reshape(len(T_world_gripper), -1, len(PARALLEL_GRIPPER)).sum(axis=1)
    return np.asarray(np.log1p(counts))


def _some(index: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """About so many of them, spread over the grid in which they are sorted."""
    return index[:: max(1, len(index) // count)]


def _mean(values: FloatArray) -> float:
    """1 if there is nothing."""
    return float(values.mean()) if len(values) else 1.0


def _explain(surface: Surface, other: Surface, which: NDArray[np.int64], T: FloatArray) -> Explained:
    """How well a surface explains some points of another one, moved by `T`, as if cameras saw all."""
    assert other.cloud.normals is not None
    points, normals = se3.apply(T, other.cloud.points[which]), se3.rotate(T, other.cloud.normals[which])
    return surface.explain(points, normals, other.shades[which], np.full(len(which), OFFSET))
