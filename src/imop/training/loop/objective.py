"""What is asked of the networks: the losses of those that are trained, and the poses that they lead to."""

import torch
from torch import Tensor, nn

from imop.networks.matching import Correspondence, reposition
from imop.networks.model import Model
from imop.networks.pose import MatchedPose, RegressedPose
from imop.training.config import Network
from imop.training.data.pairs import PairBatch
from imop.training.data.route_batch import RouteBatch
from imop.training.loop import losses


class Objective(nn.Module):
    """Batches -> losses of all networks that are trained, one module that can be distributed."""

    def __init__(self, model: Model, networks: tuple[Network, ...]):
        super().__init__()
        self.pairs = PairLoss(model, networks)
        self.routing = model.routing if "routing" in networks else None

    def forward(self, pairs: PairBatch | None, routes: RouteBatch | None) -> dict[str, Tensor]:
        """Losses by name."""
        parts = {} if pairs is None else self.pairs(pairs)
        if routes is not None and self.routing is not None:
            asked = (routes.shown, routes.demonstration, routes.query, routes.of, routes.expected)
            scores, _ = self.routing(*asked)
            parts["routing"] = losses.routing(scores, routes.right)
        return parts


class PairLoss(nn.Module):
    """Batch of pairs -> losses of the region, matching and pose networks, as far as they are trained."""

    def __init__(self, model: Model, networks: tuple[Network, ...]):
        super().__init__()
        self.region = model.region if "region" in networks else None
        self.matching = model.matching if "matching" in networks else None
        self.pose = model.pose if "pose" in networks else None

    def forward(self, batch: PairBatch) -> dict[str, Tensor]:
        """Focal and Dice over all stages, the spread, matching over all layers, and the pose's."""
        before = batch.step.before
        parts: dict[str, Tensor] = {}
        if self.region is not None:
            predicted = self.region(batch.step)
            stages = predicted.stages
            focal = [losses.focal(stage, batch.region, before.cloud, before.size) for stage in stages]
            dice = [losses.dice(stage, batch.region, before.cloud, before.size) for stage in stages]
            parts |= {"focal": torch.stack(focal).sum(), "dice": torch.stack(dice).sum()}
            parts["spread"] = losses.spread(predicted.spread, batch.invariance, before.cloud, before.size)
        found = None
        if self.matching is not None:
            found = self.matching(batch.step, batch.chosen, batch.query)
            parts["matching"] = losses.matching(found.layers, batch.targets)
        if self.pose is not None:
            right = [goals.to(before.points.device) for goals in right_poses(batch)]
            parts["pose"] = losses.pose(_regressed(self.pose, batch, found), right)
        return parts


def right_poses(batch: PairBatch) -> list[Tensor]:
    """Per sample (S, 4, 4) float64 on the CPU: where in the query the gripper may go."""
    goals = batch.step.T_world_goal.double().cpu()
    return [motions @ goal for motions, goal in zip(batch.right, goals, strict=True)]


def predicted_poses(model: Model, batch: PairBatch, found: Correspondence) -> Tensor:
    """(B, 4, 4) where in each query the gripper goes, by the method that the model's configuration names."""
    if model.pose is None:
        return reposition(found.last, found.p_region, found.p_query) @ batch.step.T_world_goal
    return _regressed(model.pose, batch, found)


def _regressed(
    network: MatchedPose | RegressedPose, batch: PairBatch, found: Correspondence | None
) -> Tensor:
    if isinstance(network, MatchedPose):
        assert found is not None
        T: Tensor = network(found, batch.step.T_world_goal)
    else:
        T = network(batch.step, batch.query)
    return T
