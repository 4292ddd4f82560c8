"""The paper's algorithm as it is written: one region, one correspondence matrix, one fit.

There is no search, no verification and no rule: this is section III-C and nothing else. The difference to
`learned` measures what imop adds. It also runs the paper's ablations, whose networks may regress the
pose instead.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from imop.errors import CorruptData
from imop.geometry import se3
from imop.geometry.cloud import farthest_points
from imop.geometry.perception import Perception
from imop.geometry.procrustes import weighted_procrustes
from imop.networks.graph import Graph, build_graph
from imop.networks.matching import Correspondence
from imop.networks.model import BUNDLED, Model, load_model
from imop.networks.pose import MatchedPose
from imop.networks.region import StepBatch
from imop.policy.interfaces import BEGINNING, Candidate, Feasible, Progress, Scene, Transition
from imop.policy.learned import FEWEST, step_batches
from imop.policy.one_shot import OneShotPolicy
from imop.policy.router import LearnedRouter, Odds
from imop.types import FloatArray

UNWEIGHED = Odds(back=1.0, skip=1.0, change=1.0)
"""The routing network alone decides, as in the paper."""
# A region point counts as matched from this much confidence on.
MATCHED = 0.1


def paper_policy(
    weights: Path = BUNDLED,
    perception: Perception | None = None,
    min_confidence: float = 0.0,
    feasible: Feasible | None = None,
) -> OneShotPolicy:
    """The policy of the paper: region, matching and state routing networks, and least squares.

    Args:
        weights: folder with weights and card; by default the bundled ones.
        perception: makes clouds of observations; by default the robot stays in them.
        min_confidence: below it `act` raises `NoConfidentMatch`.
        feasible: whether the arm can take the gripper to a pose. The paper has one candidate, so it is only
            said of it.

    Raises:
        CorruptData: if the weights cannot be used, or have no trained routing network.
    """
    model = load_model(weights)
    if not model.routing.trained:
        raise CorruptData(weights, "has no trained routing network", "merge one into it (docs/training.md)")
    router = LearnedRouter(model, UNWEIGHED)
    return OneShotPolicy(PaperMatcher(model), perception or Perception(), router, min_confidence, feasible)


@dataclass(frozen=True)
class PaperMatcher:
    """Region and matching networks, and Eq. (2); or a network for the pose, if the model has one.

    Attributes:
        model: the networks.
        threshold: least probability of a region point (0.5; on real clouds the paper takes 0.1).
    """

    model: Model
    threshold: float = 0.5

    def prepare(self, steps: Sequence[Transition]) -> list["PaperStep"]:
        """Find the regions of a demonstration's steps."""
        batches = step_batches(self.model.config.graph, steps)
        return [
            PaperStep(self.model, step, batch, find_points(self.model, batch, self.threshold))
            for step, batch in zip(steps, batches, strict=True)
        ]


def find_points(model: Model, batch: StepBatch, threshold: float) -> Tensor:
    """(R,) indices of the points of s_i that are matched: the region, spread out if they are too many.

    Without `region_first`, points of all of s_i; the likeliest few where the network finds no region.
    """
    points = batch.before.points.double().numpy()
    inside = torch.arange(len(points))
    if model.config.matching.region_first:
        with torch.inference_mode():
            probability = model.region(batch).probability
        count = min(max(int((probability > threshold).sum()), FEWEST), len(probability))
        inside = probability.topk(count).indices
    few = farthest_points(points[inside.numpy()], model.config.matching.max_region)
    return inside[torch.from_numpy(few)].sort().values


class PaperStep:
    """A demonstrated step and the points of its region, as the networks see them."""

    def __init__(self, model: Model, step: Transition, batch: StepBatch, chosen: Tensor) -> None:
        self._model, self._batch = model, batch
        self._T_goal = step.action.T_world_gripper
        self._region = batch.before.points[chosen].double().numpy()
        with torch.inference_mode():
            self._described = model.matching.describe(batch, chosen)

    @property
    def region(self) -> FloatArray:
        """(M, 3) points of the region in the demonstrated scene that are matched."""
        return self._region

    @property
    def spread(self) -> None:
        """None: nothing is known of the spread."""
        return None

    def locate(
        self, query: Scene, progress: Progress = BEGINNING, feasible: Feasible | None = None
    ) -> tuple[Candidate, ...]:
        """The one motion that the networks lead to; what the episode did before is not asked.

        Its probability is the share of the region that found a counterpart, for the paper has none.
        """
        if len(query.cloud) < FEWEST:
            return ()
        seen = build_graph(query.cloud, self._model.config.graph, query.ground)
        with torch.inference_mode():
            found = self._model.matching.match(self._described, seen)
            T_query_support = self._motion(seen, found)
        mass = found.last[0].sum(dim=1).double().numpy()
        best = found.p_query[0, found.last[0].argmax(dim=1)].double().numpy()
        candidate = Candidate(
            T_query_support,
            float(np.clip(mass.mean(), 0.0, 1.0)),
            self._region[mass > MATCHED],
            best[mass > MATCHED],
            self._model.config.pose.method,
            None if feasible is None else feasible(se3.orthonormal(T_query_support @ self._T_goal)),
        )
        return (candidate,)

    def _motion(self, seen: Graph, found: Correspondence) -> FloatArray:
        """(4, 4) motion of the region into the query, by least squares or by the network for the pose."""
        pose = self._model.pose
        if pose is None:
            fitted: FloatArray = least_squares(found)[0].numpy()
            return fitted
        matched = isinstance(pose, MatchedPose)
        T = pose(found, self._batch.T_world_goal) if matched else pose(self._batch, seen)
        return se3.orthonormal(T[0].double().numpy()) @ se3.invert(self._T_goal)


def least_squares(found: Correspondence) -> Tensor:
    """(B, 4, 4) float64 motion of the region by Eq. (2): least sum of C_pq ||T p - q||^2 over all pairs.

    For each p the pairs act like one with the mean of its q, weighted by C, and the sum of its weights.
    """
    C = found.last.double()
    weight = C.sum(dim=2)
    y = C @ found.p_query.double() / weight.clamp_min(1e-12)[..., None]
    return weighted_procrustes(found.p_region.double(), y, weight).T_y_x
