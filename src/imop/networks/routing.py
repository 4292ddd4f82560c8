"""The state routing network: which demonstrated step does the present state call for?

Paper, section III-C3: scene features, joined with the robot's state and the timestep, attend to each other
across the demonstration's states; the state with the strongest attention to the query is the support state.

Things and gripper stand elsewhere in the query, so nothing here changes when a whole state is moved along the
table or turned about the vertical. Joint positions would, and are not used: the gripper's height, tilt and
opening are, and where every point is as seen from the gripper, since clouds do not show the robot.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import torch
from torch import Tensor, nn

from imop.networks.backbone import Backbone, BackboneConfig
from imop.networks.blocks import MLP, DenseBlock, pad, pool_max, pool_mean
from imop.networks.graph import POINT_FEATURES, Graph, collate
from imop.types import FloatArray

HAND_FEATURES = 7
STATE = 7
# Points this near to the gripper, metres, are pooled apart from the others.
NEAR = (0.04, 0.12)
UNKNOWN = -1.0


@dataclass(frozen=True)
class RoutingConfig:
    """Shape of the routing network.

    Attributes:
        backbone: makes the scene features. By default points are not compared with their neighbours, since
            the graph's features tell enough of them and routing has to learn from few scenes.
        width: of a state's feature.
        layers: rounds of attention among the demonstration's states and from the query to them.
        heads: of the attention.
        low_dimensional: whether the gripper's state and the step are among the inputs (the paper's ablation).
    """

    backbone: BackboneConfig = field(
        default_factory=lambda: BackboneConfig(POINT_FEATURES + HAND_FEATURES, (64,), (0,))
    )
    width: int = 96
    layers: int = 2
    heads: int = 4
    low_dimensional: bool = True


@dataclass(frozen=True, eq=False)
class States:
    """A batch of states as tensors.

    Attributes:
        graph: their clouds.
        T_world_gripper: (N, 4, 4).
        opening: (N,) of the gripper, 0 closed .. 1 open.
        step: (N,) number of the step that a demonstrated state is before; for a query the step that comes
            next if every action so far did what was demonstrated, or `UNKNOWN`.
    """

    graph: Graph
    T_world_gripper: Tensor
    opening: Tensor
    step: Tensor

    def to(self, device: torch.device | str) -> "States":
        """The same states on a device."""
        rest = (self.T_world_gripper, self.opening, self.step)
        return States(self.graph.to(device), *(t.to(device) for t in rest))


def make_states(
    graphs: Sequence[Graph], T_world_gripper: FloatArray, opening: Sequence[float], step: Sequence[float]
) -> States:
    """States of what was seen: graphs of clouds without the robot; the rest as in `States`."""
    return States(
        collate(graphs),
        torch.from_numpy(np.asarray(T_world_gripper, dtype=np.float32)),
        torch.tensor(list(opening), dtype=torch.float32),
        torch.tensor(list(step), dtype=torch.float32),
    )


@dataclass(frozen=True, eq=False)
class Described:
    """What the network makes of single states: features (N, width) and the robot's state (N, STATE)."""

    scene: Tensor
    robot: Tensor


class RoutingNetwork(nn.Module):
    """Demonstrations' states and query states -> one score per demonstrated step."""

    def __init__(self, config: RoutingConfig):
        super().__init__()
        self.config = config
        self.backbone = Backbone(config.backbone)
        width = config.backbone.widths[0]
        self.point = nn.Sequential(nn.LayerNorm(width), MLP(width, 2 * width, width))
        pooled = (2 + len(NEAR)) * width + len(NEAR)
        self.scene = MLP(pooled + STATE, 2 * config.width, config.width)
        self.within = nn.ModuleList(DenseBlock(config.width, config.heads) for _ in range(config.layers))
        self.across = nn.ModuleList(
            DenseBlock(config.width, config.heads, cross=True) for _ in range(config.layers)
        )
        self.compare = MLP(3 * config.width + STATE, config.width, 1)

    def forward(
        self, shown: States, demonstration: Tensor, query: States, of: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Score the steps of demonstrations for queries.

        Args:
            shown: all demonstrated states, demonstration after demonstration.
            demonstration: (S,) number of the demonstration of each.
            query: Q states.
            of: (Q,) number of the demonstration that each is compared with.

        Returns:
            (Q, L) scores and (Q, L) True where there is a step.
        """
        return self.score(self.describe(shown), demonstration, self.describe(query), of)

    def describe(self, states: States) -> Described:
        """Features of each state by itself."""
        graph = states.graph
        local, distance = _in_hand(states)
        hand, robot = _hand_features(local, distance), _robot_features(states)
        if not self.config.low_dimensional:
            hand, robot, distance = hand * 0, robot * 0, distance * 0
        points = self.backbone(graph, torch.cat([graph.features, hand], dim=1))
        points = (points + self.point(points)).float()
        pooled = [pool(points, graph.cloud, graph.size) for pool in (pool_mean, pool_max)]
        for radius in NEAR:
            weight = torch.exp(-((distance / radius) ** 2))
            total = points.new_zeros(graph.size, 1).index_add(0, graph.cloud, weight)
            near = points.new_zeros(graph.size, points.shape[1]).index_add(0, graph.cloud, weight * points)
            pooled += [near / (total + 0.1), total.log1p()]
        return Described(self.scene(torch.cat([*pooled, robot], dim=1)), robot)

    def score(
        self, shown: Described, demonstration: Tensor, query: Described, of: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Scores as `forward` gives them, of states that were described before."""
        count = int(demonstration.max()) + 1
        keys, present = pad(shown.scene, demonstration, count)
        robot, _ = pad(shown.robot, demonstration, count)
        mask = present[:, None].expand(-1, keys.shape[1], -1)
        asked = query.scene[:, None]
        for within, across in zip(self.within, self.across, strict=True):
            keys = within(keys, mask)
            asked = across(asked, present[of, None], keys[of])
        keys, present, robot = keys[of], present[of], robot[of]
        asked = asked.expand_as(keys)
        pairs = [asked, keys, (asked - keys).abs(), query.robot[:, None] - robot]
        scores: Tensor = self.compare(torch.cat(pairs, dim=-1))[..., 0].float()
        return scores.masked_fill(~present, -1e9), present


def _in_hand(states: States) -> tuple[Tensor, Tensor]:
    """(M, 3) points in the gripper's frame and (M, 1) their distances from its origin, metres."""
    graph = states.graph
    T = states.T_world_gripper[graph.cloud]
    local = ((graph.points - T[:, :3, 3])[:, :, None] * T[:, :3, :3]).sum(dim=1)
    return local, (local.square().sum(1, keepdim=True) + 1e-8).sqrt()


def _hand_features(local: Tensor, distance: Tensor) -> Tensor:
    """(M, HAND_FEATURES): bounded coordinates, distance, and nearness at three scales."""
    nearness = [torch.exp(-distance / scale) for scale in (0.02, 0.06, 0.2)]
    return torch.cat([local / (0.1 + distance), distance.log1p(), *nearness], dim=1)


def _robot_features(states: States) -> Tensor:
    """(N, STATE): opening, height above the plane, tilt, and the step with whether it is known."""
    graph, T = states.graph, states.T_world_gripper
    # The graph's fourth feature is the height above the plane in units of 20 cm.
    plane = pool_mean(graph.points[:, 2:] - 0.2 * graph.features[:, 3:4], graph.cloud, graph.size)[:, 0]
    known = (states.step >= 0).float()
    columns = [
        states.opening,
        (states.opening < 0.03).float(),
        (T[:, 2, 3] - plane) / 0.2,
        T[:, 2, 2],
        T[:, 2, 1].abs(),
        known * states.step / 4,
        known,
    ]
    return torch.stack(columns, dim=1)
