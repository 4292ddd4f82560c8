"""The state routing network: which demonstrated step does the present state call for?

Paper, section III-C3: scene features, joined with the robot's joint positions and the timestep, attend to
each other across the demonstration's states; the state with the strongest attention to the query is the
support state.
"""

from dataclasses import dataclass, field

import torch
from torch import Tensor, nn

from imop.networks.backbone import Backbone, BackboneConfig
from imop.networks.blocks import MLP, DenseBlock, pad, pool_max, pool_mean
from imop.networks.graph import Graph

JOINTS = 7
STATE = JOINTS + 1 + 2


@dataclass(frozen=True)
class RoutingConfig:
    """Shape of the routing network.

    Attributes:
        backbone: makes the scene features.
        width: of a state's feature.
        layers: rounds of attention among the demonstration's states and from the query to them.
        heads: of the attention.
        low_dimensional: whether joints, gripper and timestep are among the inputs (the paper's ablation).
    """

    backbone: BackboneConfig = field(
        default_factory=lambda: BackboneConfig(widths=(32, 48, 96), depths=(1, 1, 1))
    )
    width: int = 96
    layers: int = 2
    heads: int = 4
    low_dimensional: bool = True


class RoutingNetwork(nn.Module):
    """Demonstrations' states and query states -> one score per demonstrated step."""

    def __init__(self, config: RoutingConfig):
        super().__init__()
        self.config = config
        self.backbone = Backbone(config.backbone)
        scene = 2 * config.backbone.widths[0]
        self.scene = MLP(scene + STATE, 2 * config.width, config.width)
        self.within = nn.ModuleList(DenseBlock(config.width, config.heads) for _ in range(config.layers))
        self.across = nn.ModuleList(
            DenseBlock(config.width, config.heads, cross=True) for _ in range(config.layers)
        )
        self.query = nn.Linear(config.width, config.width)
        self.key = nn.Linear(config.width, config.width)

    def forward(
        self, states: Graph, robot: Tensor, demonstration: Tensor, query: Graph, query_robot: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Score the steps of each demonstration for its query.

        Args:
            states: clouds of all demonstrated states, demonstration after demonstration.
            robot: (S, STATE) joint positions, gripper opening, step number, and its share of the whole.
            demonstration: (S,) which demonstration (and query) a state belongs to.
            query: one cloud per demonstration.
            query_robot: (B, STATE) likewise; the share of the whole is 0 for a query.

        Returns:
            (B, L) scores and (B, L) True where there is a step.
        """
        keys, present = pad(self.describe(states, robot), demonstration, query.size)
        asked = self.describe(query, query_robot)[:, None]
        mask = present[:, None].expand(-1, keys.shape[1], -1)
        for within, across in zip(self.within, self.across, strict=True):
            keys = within(keys, mask)
            asked = across(asked, present[:, None], keys)
        scores = (self.query(asked) @ self.key(keys).mT)[:, 0] / self.config.width**0.5
        return scores.masked_fill(~present, -1e9), present

    def describe(self, graph: Graph, robot: Tensor) -> Tensor:
        """(B, width) feature of each state: mean and largest point features, with the robot's state."""
        points = self.backbone(graph)
        scene = [pool(points, graph.cloud, graph.size) for pool in (pool_mean, pool_max)]
        if not self.config.low_dimensional:
            robot = torch.zeros_like(robot)
        described: Tensor = self.scene(torch.cat([*scene, robot], dim=1))
        return described
