"""The learned matcher: the paper's region and matching networks, before the search.

The region network says once per demonstrated step which points the action is fixed to, and how far each may
be off on another thing of its kind. The matching network says which points of the query they are. The paper
fits one motion to all of these matches; here that is one proposal among others.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import torch
from torch import Tensor

from imop.geometry import se3
from imop.geometry.cloud import PointCloud, farthest_points
from imop.geometry.clusters import connected, find_objects
from imop.geometry.neighbours import nearest, within
from imop.networks.graph import Graph, GraphConfig, build_graph
from imop.networks.matching import reposition
from imop.networks.model import Model
from imop.networks.region import StepBatch, Transport, next_transport, one_step
from imop.policy.contacts import SAME, Contacts, find_contacts, is_open
from imop.policy.interfaces import BEGINNING, Candidate, Feasible, PolicyConfig, Progress, Scene, Transition
from imop.policy.proposals import Asked, Matches
from imop.policy.region import Region, find_region
from imop.policy.search import StepSearch
from imop.policy.verification import Verifier
from imop.types import FloatArray

# A region of fewer points cannot be matched.
FEWEST = 8
# Points nearer to each other than this are of one voxel or of neighbours, metres.
NEXT = 0.006


@dataclass(frozen=True, eq=False)
class ShownRegion:
    """A region and where it comes from.

    Attributes:
        steps: a batch of the step alone, as the networks see it.
        probability: (N,) of the points of the support state to be in the region, by the network.
        trust: (N,) of them in a fit to another thing; see `RegionPrediction.trust`.
        inside: (R,) those that are, in order of their index.
        region: the same on the full cloud.
        completed: (M, 3) points of the region, metres. A thing that is mostly in the region is whole.
        payload: what the hand takes next and moves, if the region is much more than that.
    """

    steps: StepBatch
    probability: Tensor
    trust: Tensor
    inside: Tensor
    region: Region
    completed: FloatArray
    payload: PointCloud | None

    @property
    def graph(self) -> Graph:
        """Of the support state."""
        return self.steps.before


@dataclass(frozen=True)
class LearnedMatcher:
    """Region and matching networks.

    Attributes:
        model: the networks; see `networks.model.load_model`.
        config: of the search.
    """

    model: Model
    config: PolicyConfig = field(default_factory=PolicyConfig)

    def prepare(self, steps: Sequence[Transition]) -> list["LearnedStep"]:
        """Find the regions of a demonstration's steps and describe them."""
        shown = find_shown_regions(self.model, steps, self.config)
        return [
            LearnedStep(self.model, self.config, step, region)
            for step, region in zip(steps, shown, strict=True)
        ]


class LearnedStep:
    """A demonstrated step prepared for the matching network."""

    def __init__(self, model: Model, config: PolicyConfig, step: Transition, shown: ShownRegion) -> None:
        self._model, self._config, self._shown = model, config, shown
        points = shown.graph.points[shown.inside].double().numpy()
        few = farthest_points(points, model.config.matching.max_region)
        self._chosen = shown.inside[torch.from_numpy(few).sort().values]
        with torch.inference_mode():
            self._described = model.matching.describe(shown.steps, self._chosen)
        self._trust = shown.trust[self._chosen]
        self._weight = shown.probability[self._chosen].double().numpy()
        verifier = Verifier(model.verification)
        self.search = StepSearch(config, step, shown.region, shown.payload, verifier, self._ask)

    @property
    def region(self) -> FloatArray:
        """(M, 3) points of the region in the demonstrated scene; things that lie mostly in it are whole."""
        return self._shown.completed

    @property
    def spread(self) -> FloatArray:
        """(M,) metres, of the points of the region; see `PreparedStep.spread`."""
        region = self._shown.region
        return np.asarray(region.spreads[nearest(self.region, region.cloud.points)[1][:, 0]])

    def locate(
        self, query: Scene, progress: Progress = BEGINNING, feasible: Feasible | None = None
    ) -> tuple[Candidate, ...]:
        """Where the region may be in the query, likeliest first; see `PreparedStep.locate`."""
        return self.search.locate(query, progress, feasible)

    def _ask(self, query: Scene) -> Asked:
        """The network's matches in a query, and the motions that most of them agree on."""
        seen = build_graph(query.cloud, self._model.config.graph, query.ground)
        with torch.inference_mode():
            found = self._model.matching.match(self._described, seen)
            fits = [
                reposition(found.last, found.p_region, found.p_query, trust)
                for trust in (None, self._trust[None])
            ]
        matches = likeliest(
            found.last[0], self._shown.graph, self._chosen, seen, self._weight, self._config.counterparts
        )
        fit, firm = (np.asarray(T[0].double().numpy()) for T in fits)
        return Asked({"fit": fit, "firm": firm}, matches)


def find_shown_regions(model: Model, steps: Sequence[Transition], config: PolicyConfig) -> list[ShownRegion]:
    """The region of every step of one demonstration, by the region network."""
    objects = [find_objects(step.before.cloud, step.before.ground.plane) for step in steps]
    contacts = find_contacts(steps, objects)
    instead = [find_region(steps, k, objects[k], contacts, config).cloud for k in range(len(steps))]
    batches = step_batches(model.config.graph, steps)
    return [
        _find(model, batches[k], steps, k, contacts, config, instead[k].points) for k in range(len(steps))
    ]


def _find(
    model: Model,
    batch: StepBatch,
    steps: Sequence[Transition],
    k: int,
    contacts: Contacts,
    config: PolicyConfig,
    instead: FloatArray,
) -> ShownRegion:
    """The region of step `k`, or what is at points (M, 3) `instead` if that cannot be the region."""
    step = steps[k]
    with torch.inference_mode():
        predicted = model.region(batch)
    nodes = batch.before.points.double().numpy()
    meant = torch.from_numpy(step.before.focused(nodes, SAME))
    probability = torch.where(meant, predicted.probability, 0.0) if meant.any() else predicted.probability
    inside = _likely(probability, config.threshold)
    standing = ~step.before.ground.bare[nearest(nodes, step.before.cloud.points)[1][:, 0]]
    p_held = contacts.p_gripper_held[k]
    region = _dense(step, nodes, probability.double().numpy(), inside, p_held, config)
    beside = np.flatnonzero(within(nodes, instead, SAME) & standing)
    # The ground is the same everywhere, and a scrap somewhere else says nothing about this place.
    nothing = standing[inside].sum() < FEWEST
    farther = _away(step, p_held, region.cloud.points) - _away(step, p_held, instead)
    scrap = len(region.cloud) < config.scrap and farther > config.farther
    if len(beside) >= FEWEST and (nothing or scrap):
        inside = torch.from_numpy(beside)
        region = _dense(step, nodes, probability.double().numpy(), inside, p_held, config)
    payload = _payload(step, region, contacts.taken(k, steps), config)
    points = _completed(step, nodes, probability, region, config.threshold)
    owner = nearest(region.cloud.points, nodes)[1][:, 0]
    region = replace(region, spread=predicted.spread.double().numpy()[owner])
    return ShownRegion(batch, probability, predicted.trust, inside, region, points, payload)


def _away(step: Transition, p_gripper_held: FloatArray, points: FloatArray) -> float:
    """Metres from points (M, 3) to where the step takes the tip and what is held."""
    p_goal = se3.apply(step.action.T_world_gripper, np.concatenate([np.zeros((1, 3)), p_gripper_held]))
    return float(nearest(p_goal, points)[0].min())


def step_batches(shape: GraphConfig, steps: Sequence[Transition]) -> list[StepBatch]:
    """The steps of one demonstration, each alone, as the networks see them."""
    scenes = {id(scene): scene for step in steps for scene in (step.before, step.after)}
    graphs = {key: build_graph(scene.cloud, shape, scene.ground) for key, scene in scenes.items()}
    opened = [is_open(step) for step in steps]
    found = []
    for k, step in enumerate(steps):
        observation, action = step.before.observation, step.action
        poses = np.stack([action.T_world_gripper, observation.T_world_gripper]).astype(np.float32)
        gripper = torch.tensor([opened[k], action.gripper_open], dtype=torch.float32)
        before, after = graphs[id(step.before)], graphs[id(step.after)]
        later, transport = steps[next_transport(opened, k)], None
        if later is not step:
            begins, ends = later.before, later.after
            hands = np.stack([scene.observation.T_world_gripper for scene in (begins, ends)])
            transport = Transport(graphs[id(ends)].points.double().numpy(), hands)
        found.append(one_step(before, after, torch.from_numpy(poses), gripper, shape.neighbours, transport))
    return found


def _likely(probability: Tensor, threshold: float) -> Tensor:
    """(R,) points of the region, in order of their index; the likeliest few if there seems to be none."""
    count = int((probability > threshold).sum())
    count = min(max(count, FEWEST), len(probability))
    return probability.topk(count).indices.sort().values


def _dense(
    step: Transition,
    nodes: FloatArray,
    probability: FloatArray,
    inside: Tensor,
    p_gripper_held: FloatArray,
    config: PolicyConfig,
) -> Region:
    """The region on the full cloud: every point belongs as much as the nearest of `nodes` (N, 3) does."""
    cloud = step.before.cloud
    weight = np.zeros(len(nodes))
    weight[inside] = np.maximum(probability[inside], 1e-3)
    owner = nearest(cloud.points, nodes)[1][:, 0]
    member = weight[owner] > 0
    # The bare table is found everywhere.
    standing = ~step.before.ground.bare
    member = member & standing if (member & standing).sum() >= FEWEST else member
    p_held = se3.apply(step.before.observation.T_world_gripper, p_gripper_held)
    in_hand = within(cloud.points, p_held, SAME)
    # A step that lets go is fixed to what stays, not to what is let go.
    most = config.lets_go if step.action.gripper_open else 0.5
    if (member & ~in_hand).sum() >= FEWEST and in_hand[member].mean() < most:
        member = member & ~in_hand
    else:
        in_hand, p_gripper_held = np.zeros(len(cloud), dtype=bool), p_gripper_held[:0]
    region = cloud.select(member)
    free = np.flatnonzero(standing & ~in_hand | member)
    labels, own = connected(cloud.points[free]), member[free]
    # What only stands by says nothing about the region.
    around = ~own & np.isin(labels, labels[own]) & within(cloud.points[free], region.points, config.connected)
    context = cloud.select(free[around]) if around.any() else None
    return Region(region, weight[owner[member]], p_gripper_held, context)


def _completed(
    step: Transition, nodes: FloatArray, probability: Tensor, region: Region, threshold: float
) -> FloatArray:
    """(M, 3) points of the region and of the things that are in it by the mean of their probabilities.

    The network leaves holes where little is seen. What it is sure of is enough to find a thing again, and
    leads to better poses than the rest would.
    """
    cloud = step.before.cloud
    p_held = se3.apply(step.before.observation.T_world_gripper, region.p_gripper_held)
    rest = cloud.points[~step.before.ground.bare & ~within(cloud.points, p_held, SAME)]
    if not len(rest):
        return region.cloud.points
    labels = connected(rest)
    of_node = probability.double().numpy()[nearest(rest, nodes)[1][:, 0]]
    mean = np.bincount(labels, weights=of_node) / np.bincount(labels)
    return np.unique(np.concatenate([region.cloud.points, rest[mean[labels] > threshold]]), axis=0)


def _payload(
    step: Transition, region: Region, p_taken: FloatArray, config: PolicyConfig
) -> PointCloud | None:
    """What the hand takes next, at points (H, 3), if the region is much more than that."""
    known = within(p_taken, region.cloud.points, SAME)
    if len(p_taken) < config.fewest or known.mean() < config.known:
        return None
    cloud = step.before.cloud.select(within(step.before.cloud.points, p_taken, NEXT))
    taken = within(region.cloud.points, cloud.points, SAME)
    return None if len(cloud) < config.fewest or taken.mean() > config.alone else cloud


def likeliest(
    C: Tensor, region: Graph, chosen: Tensor, query: Graph, probability: FloatArray, counterparts: int
) -> Matches:
    """The likeliest query points of every region point.

    Args:
        C: (R, N) correspondence matrix.
        region: the demonstrated scene.
        chosen: (R,) its points that are the region.
        query: the observed scene, of N points.
        probability: (R,) of being in the region.
        counterparts: how many for each.
    """
    weight, best = C.topk(min(counterparts, C.shape[1]), dim=1)
    i = torch.arange(len(weight)).repeat_interleave(weight.shape[1])
    x, n_x = (values[chosen][i].double().numpy() for values in _surface(region))
    y, n_y = (values[best.flatten()].double().numpy() for values in _surface(query))
    return Matches(x, n_x, y, n_y, weight.flatten().double().numpy() * probability[i] + 1e-6)


def _surface(graph: Graph) -> tuple[Tensor, Tensor]:
    return graph.levels[0].points, graph.levels[0].normals
