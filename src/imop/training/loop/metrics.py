"""How good the networks are on pairs that they were not trained on.

imop training metrics --shards DIR [DIR ...] [--weights FOLDER] [--pairs N]
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from imop.geometry import se3
from imop.geometry.accuracy import COARSE, FINE
from imop.networks.blocks import pad
from imop.networks.matching import reposition
from imop.networks.model import BUNDLED, Model
from imop.training.data.datasets import PairDataset, RouteDataset, loader
from imop.training.data.pairs import PairBatch
from imop.training.data.route_batch import RouteBatch
from imop.training.loop import losses
from imop.training.loop.objective import predicted_poses, right_poses

_BATCH = 8


def validate(model: Model, folder: Path, count: int) -> dict[str, float]:
    """Means over the first `count` pairs of a folder of shards, without augmentation.

    Returns:
        region_iou: intersection over union at 0.5. match: share of visible region points whose best match is
        at most 2 cm from the true one. within_2cm_10deg, within_1cm_5deg: share of pairs whose predicted
        pose is that near to one of the right ones. firm_2cm_10deg, firm_1cm_5deg: the same of the pose by
        least squares with the weights of the spread. spread: negative log-likelihood of the distances of
        counterparts on other things.
    """
    dataset = PairDataset([folder], model.config, seed=0, augmented=False)
    numbers = range(min(count, len(dataset)))
    found: dict[str, list[float]] = {}
    training = model.training
    model.eval()
    with torch.no_grad():
        for batch in loader(dataset, numbers, _BATCH, workers=0):
            for name, values in _measure(model, batch).items():
                found.setdefault(name, []).extend(values)
    model.train(training)
    return {name: float(np.mean(values)) for name, values in found.items()}


def validate_routes(model: Model, folder: Path, count: int) -> dict[str, float]:
    """Means over the queries of the first `count` routes of a folder of shards, without augmentation.

    Returns:
        routing: share of the queries for which the best step is a right one. routing_mishaps: of the queries
        in which another step than the expected one is right. routing_ordinary: of the others.
    """
    found: dict[str, list[float]] = {"routing": [], "routing_ordinary": [], "routing_mishaps": []}
    dataset = RouteDataset([folder], model.config, seed=0, augmented=False)
    training = model.training
    model.eval()
    with torch.no_grad():
        for batch in loader(dataset, range(min(count, len(dataset))), _BATCH, workers=0):
            scores, _ = model.routing(batch.shown, batch.demonstration, batch.query, batch.of, batch.expected)
            right = batch.right.gather(1, scores.argmax(dim=1, keepdim=True))[:, 0].float()
            wrong = _mishaps(batch)
            found["routing"] += right.tolist()
            found["routing_ordinary"] += right[~wrong].tolist()
            found["routing_mishaps"] += right[wrong].tolist()
    model.train(training)
    return {name: float(np.mean(values)) for name, values in found.items() if values}


def _mishaps(batch: RouteBatch) -> Tensor:
    """(Q,) True where the expected step is not right."""
    past_the_end = batch.expected >= batch.right.shape[1]
    known = batch.right.gather(1, batch.expected.clamp(0, batch.right.shape[1] - 1)[:, None])[:, 0]
    return past_the_end | ~known


def _measure(model: Model, batch: PairBatch) -> dict[str, list[float]]:
    before = batch.step.before
    predicted = model.region(batch.step)
    inside = predicted.stages[-1] > 0
    found = model.matching(batch.step, batch.chosen, batch.query)
    T = predicted_poses(model, batch, found).double().numpy()
    trust, _ = pad(predicted.trust[batch.chosen, None], before.cloud[batch.chosen], before.size)
    moved = reposition(found.last, found.p_region, found.p_query, trust[..., 0])
    T_firm = (moved @ batch.step.T_world_goal).double().numpy()
    best = found.last.argmax(dim=2)
    measured: dict[str, list[float]] = {"region_iou": [], "match": []}
    for b, motions in enumerate(batch.targets):
        here = before.cloud == b
        truth = batch.region[here] > 0.5
        if batch.invariance[here].nansum() > 0:
            each = predicted.spread[here], batch.invariance[here], before.cloud[here] - b
            measured.setdefault("spread", []).append(losses.spread(*each, size=1).item())
        union = (inside[here] | truth).sum()
        measured["region_iou"].append(float((inside[here] & truth).sum() / union))
        if any(len(pairs) for pairs in motions):
            p_found = found.p_query[b][best[b]]
            near = [
                (p_found[pairs[:, 0]] - found.p_query[b][pairs[:, 1]]).norm(dim=1) < 0.02
                for pairs in motions
                if len(pairs)
            ]
            measured["match"].append(max(float(hit.float().mean()) for hit in near))
    right = [goals.numpy() for goals in right_poses(batch)]
    for name, distance, angle in (("1cm_5deg", *FINE), ("2cm_10deg", *COARSE)):
        limits = distance, np.radians(angle)
        for kind, poses in (("within", T), ("firm", T_firm)):
            hits = [float(se3.near(r, p, *limits).any()) for r, p in zip(right, poses, strict=True)]
            measured[f"{kind}_{name}"] = hits
    return measured


@dataclass(frozen=True)
class MetricsOptions:
    """What to measure.

    Attributes:
        shards: folders of shards of pairs.
        weights: folder of the networks.
        pairs: how many of each folder at most.
    """

    shards: tuple[Path, ...]
    weights: Path = BUNDLED
    pairs: int = 300
