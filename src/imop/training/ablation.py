"""The paper's ablations: what each row of its table changes in the networks."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

from imop.errors import InvalidInput

if TYPE_CHECKING:
    # The command line shows these switches without waiting for torch.
    from imop.networks.model import ModelConfig


@dataclass(frozen=True)
class Ablation:
    """Rows of the paper's table, in its order; the defaults change nothing.

    Attributes:
        low_dimensional: whether the robot's state is among the inputs.
        attention: of the matching network; None keeps that of the size.
        region_first: False matches the whole support state with the query, without a region.
        neighbours: K of the graphs and of the matching network's; None keeps that of the size.
        pose: by least squares, by a network from matched points, or by a network without matches.
    """

    low_dimensional: bool = True
    attention: Literal["graph", "global"] | None = None
    region_first: bool = True
    neighbours: int | None = None
    pose: Literal["analytic", "from_matches", "regressed"] = "analytic"

    def of(self, config: "ModelConfig") -> "ModelConfig":
        """The configuration with the chosen rows instead of its own.

        Raises:
            InvalidInput: for less than one neighbour.
        """
        k, attention = self.neighbours, self.attention or config.matching.attention
        matching = replace(
            config.matching,
            attention=attention,
            region_first=self.region_first,
            low_dimensional=self.low_dimensional,
        )
        graph, route_graph = config.graph, config.route_graph
        if k is not None:
            if k < 1:
                raise InvalidInput("neighbours", f"{k}", "a whole number from 1 on")
            graph, route_graph = replace(graph, neighbours=k), replace(route_graph, neighbours=k)
            matching = replace(matching, neighbours=k)
        return replace(
            config,
            graph=graph,
            region=replace(config.region, low_dimensional=self.low_dimensional),
            matching=matching,
            routing=replace(config.routing, low_dimensional=self.low_dimensional),
            pose=replace(config.pose, method=self.pose, backbone=matching.backbone, heads=matching.heads),
            route_graph=route_graph,
        )
