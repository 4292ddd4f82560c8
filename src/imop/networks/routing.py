"""The state routing network: which demonstrated step does the present state call for?

Paper, section III-C3: scene features, joined with the robot's state and the timestep, attend to each other
across the demonstration's states; the state with the strongest attention to the query is the support state.

Here every demonstrated step is a token that compares its state with the query: in what is seen, in what
changed since the state before, in the gripper, and in where the step stands to the one that is expected next.
Tokens attend to each other, so that a step is found by what the others say: that the expected one does not
fit, and which one began what failed.

Things and gripper stand elsewhere in the query, so nothing here changes when a whole state is moved along the
table or turned about the vertical. Joint positions would, and are not used: the gripper's height, tilt and
opening are, and where every point is as seen from the gripper, since clouds do not show the robot.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn

from imop.networks.backbone import Backbone, BackboneConfig
from imop.networks.blocks import MLP, DenseBlock, Standardized, exact, pad, pool_max, pool_mean
from imop.networks.changes import CHANGES
from imop.networks.graph import LOCAL_FEATURES, Graph, collate
from imop.networks.surroundings import FIT, fit, surroundings
from imop.types import FloatArray

HAND_FEATURES = 7
INPUTS = LOCAL_FEATURES + HAND_FEATURES + CHANGES
"""Numbers per point, no bearings: where a point is as seen from the gripper says more."""
GRIPPER = 5
ROBOT = 2 * GRIPPER + 3
PLACE = 7 + 6
# Fingers that differ by less than this share of their stroke have neither closed nor opened.
STILL = 0.04
# Points this near to the gripper, metres, are pooled apart from the others.
NEAR = (0.03, 0.08, 0.16)
POOLS = 2 + len(NEAR) + 4


@dataclass(frozen=True)
class RoutingConfig:
    """Shape of the routing network.

    Attributes:
        backbone: makes features of points before they are pooled. None pools what the graph says of them,
            which is quick and tells enough: routing has to learn from few scenes.
        width: of a state's feature.
        layers: rounds of attention among the demonstration's steps.
        heads: of the attention.
        low_dimensional: whether the gripper's state and the expected step are among the inputs (the paper's
            ablation).
    """

    backbone: BackboneConfig | None = None
    width: int = 64
    layers: int = 2
    heads: int = 4
    low_dimensional: bool = True


@dataclass(frozen=True, eq=False)
class States:
    """A batch of states as tensors.

    Attributes:
        graph: their clouds with what is gone.
        change: (M, CHANGES) what is new or gone since the state before.
        T_world_gripper: (N, 2, 4, 4) in the state and in the one before.
        opening: (N, 2) of the gripper, 0 closed .. 1 open, likewise.
    """

    graph: Graph
    change: Tensor
    T_world_gripper: Tensor
    opening: Tensor

    def to(self, device: torch.device | str) -> "States":
        """The same states on a device."""
        rest = (self.change, self.T_world_gripper, self.opening)
        return States(self.graph.to(device), *(t.to(device) for t in rest))


def make_states(
    looks: Sequence[tuple[Graph, Tensor]], T_world_gripper: FloatArray, opening: FloatArray
) -> States:
    """States of what was seen: graphs and changes as `change_graph` makes them; the rest as in `States`."""
    return States(
        collate([graph for graph, _ in looks]),
        torch.cat([change for _, change in looks]),
        torch.from_numpy(np.asarray(T_world_gripper, dtype=np.float32)),
        torch.from_numpy(np.asarray(opening, dtype=np.float32)),
    )


@dataclass(frozen=True, eq=False)
class Described:
    """What the network makes of single states.

    Attributes:
        scene: (N, width) features.
        robot: (N, ROBOT) the robot's state.
        around: (N, NEAREST, 7) what stands around the gripper, as `surroundings` finds it.
    """

    scene: Tensor
    robot: Tensor
    around: Tensor


class RoutingNetwork(nn.Module):
    """Demonstrations' states and query states -> one score per demonstrated step."""

    def __init__(self, config: RoutingConfig):
        super().__init__()
        self.config = config
        self.backbone = None if config.backbone is None else Backbone(config.backbone)
        width = INPUTS if config.backbone is None else config.backbone.widths[0]
        inputs = POOLS * (width + 1) + ROBOT
        self.standardized = Standardized(inputs)
        self.scene = nn.Sequential(MLP(inputs, 2 * config.width, config.width), nn.LayerNorm(config.width))
        compared = 3 * config.width + 6 * ROBOT + PLACE + 2 * FIT
        self.compare = MLP(compared, 2 * config.width, config.width)
        self.steps = nn.ModuleList(DenseBlock(config.width, config.heads) for _ in range(config.layers))
        self.out = nn.Sequential(nn.LayerNorm(config.width), nn.Linear(config.width, 1))

    @property
    def trained(self) -> bool:
        """Whether it ever saw a training batch."""
        return bool(self.standardized.batches > 0)

    def forward(
        self, shown: States, demonstration: Tensor, query: States, of: Tensor, expected: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Score the steps of demonstrations for queries.

        Args:
            shown: all demonstrated states, demonstration after demonstration, each in its order; the state
                before the first is the first itself.
            demonstration: (S,) number of the demonstration of each.
            query: Q states.
            of: (Q,) number of the demonstration that each is compared with.
            expected: (Q,) int64 number of the step that comes next if every action so far did what was
                demonstrated; the number of steps if all were done.

        Returns:
            (Q, L) scores and (Q, L) True where there is a step.
        """
        return self.score(self.describe(shown), demonstration, self.describe(query), of, expected)

    def describe(self, states: States) -> Described:
        """Features of each state by itself."""
        graph = states.graph
        local, distance = _in_hand(states, 0)
        hand, robot = _hand_features(local, distance), _robot_features(states)
        if not self.config.low_dimensional:
            hand, robot = hand * 0, robot * 0
        points = torch.cat([graph.features[:, :LOCAL_FEATURES], hand, states.change], dim=1)
        if self.backbone is not None:
            points = self.backbone(graph, points).float()
        pooled = torch.cat([*self._pooled(states, points, distance), robot], dim=1)
        scene = self.scene(self.standardized(pooled))
        around = surroundings(graph, local, distance[:, 0], states.change[:, 2])
        return Described(scene, robot, around)

    def _pooled(self, states: States, points: Tensor, distance: Tensor) -> Iterator[Tensor]:
        """(N, width + 1) per pool: features of points (M, width) that count, and how many do."""
        graph = states.graph
        weights = [torch.ones_like(distance)]
        if self.config.low_dimensional:
            before = _in_hand(states, 1)[1]
            new = states.change[:, :1]
            weights += [torch.exp(-((distance / radius) ** 2)) for radius in NEAR]
            weights += [torch.exp(-((before / NEAR[1]) ** 2)), new * torch.exp(-((distance / NEAR[1]) ** 2))]
        else:
            weights += [torch.zeros_like(distance)] * (len(NEAR) + 2)
        for weight in (*weights, states.change[:, :1], states.change[:, 2:]):
            total = points.new_zeros(graph.size, 1).index_add(0, graph.cloud, weight)
            sums = points.new_zeros(graph.size, points.shape[1]).index_add(0, graph.cloud, weight * points)
            yield torch.cat([sums / (total + 0.1), total.log1p()], dim=1)
        yield torch.cat([pool_max(points, graph.cloud, graph.size), torch.zeros_like(total)], dim=1)

    def score(
        self, shown: Described, demonstration: Tensor, query: Described, of: Tensor, expected: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Scores as `forward` gives them, of states that were described before."""
        count = int(demonstration.max()) + 1
        scene, present = pad(shown.scene, demonstration, count)
        robot, _ = pad(shown.robot, demonstration, count)
        step = torch.arange(robot.shape[1], device=robot.device)
        last = present.sum(dim=1, keepdim=True) - 1
        near = [
            robot.take_along_dim((step + k).clamp(min=0).minimum(last)[..., None], 1) for k in (-1, 0, 1, 2)
        ]
        present, scene, around = present[of], scene[of], torch.cat(near, dim=2)[of]
        asked, hand = query.scene[:, None].expand_as(scene), query.robot[:, None]
        place = _place(expected, present, robot[of, :, 0])
        fits = _fits(shown, demonstration, query, of, expected)
        if not self.config.low_dimensional:
            place, fits = place * 0, fits * 0
        differences = [(asked - scene).abs(), hand - robot[of], hand.expand_as(robot[of])]
        tokens = self.compare(torch.cat([asked, scene, *differences, around, place, fits], dim=-1))
        mask = present[:, None].expand(-1, present.shape[1], -1)
        for block in self.steps:
            tokens = block(tokens, mask)
        scores: Tensor = self.out(tokens)[..., 0].float()
        return scores.masked_fill(~present, -1e9), present


def _fits(shown: Described, demonstration: Tensor, query: Described, of: Tensor, expected: Tensor) -> Tensor:
    """(Q, L, 2 FIT) how well what is around the gripper agrees with each step, and with the expected one."""
    around, present = pad(shown.around.flatten(1), demonstration, int(demonstration.max()) + 1)
    with exact(around):
        fits = fit(around.view(*present.shape, -1, 7)[of], query.around[:, None])
    last = present[of].sum(dim=1) - 1
    awaited = fits.take_along_dim(expected.minimum(last)[:, None, None], 1)
    return torch.cat([fits, awaited.expand_as(fits)], dim=2)


def _place(expected: Tensor, present: Tensor, opening: Tensor) -> Tensor:
    """(Q, L, PLACE) where each step stands to the expected one and in the demonstration.

    Steps are also told apart by how often the gripper closed and opened from them to the expected one, since
    what failed begins before the last time that it closed.

    Args:
        expected: (Q,).
        present: (Q, L).
        opening: (Q, L) of the gripper in the demonstrated states.
    """
    step = torch.arange(present.shape[1], device=present.device)[None]
    count = present.sum(dim=1, keepdim=True)
    ahead = step - expected[:, None]
    change = nn.functional.pad(opening[:, 1:] - opening[:, :-1], (1, 0)) * present
    columns = [ahead == 0, ahead == -1, ahead < 0, ahead.clamp(-6, 6) / 4, step / 8, step == 0]
    columns.append(expected[:, None] >= count)
    for moved in (change < -STILL, change > STILL):
        so_far = moved.cumsum(dim=1)
        times = so_far.take_along_dim(expected[:, None].minimum(count - 1), 1) - so_far
        columns += [times.clamp(-3, 3) / 2, times == 0, times == 1]
    return torch.stack([column.float().expand_as(ahead) for column in columns], dim=2)


def _in_hand(states: States, when: int) -> tuple[Tensor, Tensor]:
    """(M, 3) points in the gripper's frame, now (0) or before (1), and (M, 1) their distances, metres."""
    graph = states.graph
    T = states.T_world_gripper[graph.cloud, when]
    local = ((graph.points - T[:, :3, 3])[:, :, None] * T[:, :3, :3]).sum(dim=1)
    return local, (local.square().sum(1, keepdim=True) + 1e-8).sqrt()


def _hand_features(local: Tensor, distance: Tensor) -> Tensor:
    """(M, HAND_FEATURES): bounded coordinates, distance, and nearness at three scales."""
    nearness = [torch.exp(-distance / scale) for scale in (0.02, 0.06, 0.2)]
    return torch.cat([local / (0.1 + distance), distance.log1p(), *nearness], dim=1)


def _robot_features(states: States) -> Tensor:
    """(N, ROBOT): opening, height above the plane, tilt, now and before, and how the gripper moved."""
    graph, T = states.graph, states.T_world_gripper
    # The graph's fourth feature is the height above the plane in units of 20 cm.
    plane = pool_mean(graph.points[:, 2:] - 0.2 * graph.features[:, 3:4], graph.cloud, graph.size)
    move = T[:, 0, :3, 3] - T[:, 1, :3, 3]
    gripper = [
        states.opening,
        (states.opening < 0.03).float(),
        (T[:, :, 2, 3] - plane) / 0.2,
        T[:, :, 2, 2],
        T[:, :, 2, 1].abs(),
    ]
    moved = [move[:, 2] / 0.1, move[:, :2].norm(dim=1) / 0.1, states.opening[:, 0] - states.opening[:, 1]]
    return torch.cat([*gripper, torch.stack(moved, dim=1)], dim=1)
