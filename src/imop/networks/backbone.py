"""Point Transformer V2 as a small U-net: features of every point, from its surroundings at several scales."""

from dataclasses import dataclass
from itertools import pairwise

from torch import Tensor, nn

from imop.networks.blocks import GraphBlock, GraphBlocks, gather, pool_max, relation
from imop.networks.graph import POINT_FEATURES, Graph, Level


@dataclass(frozen=True)
class BackboneConfig:
    """Shape of the U-net, finest level first; as many widths and depths as the graph has levels.

    Attributes:
        inputs: numbers per point.
        widths: of the features at each level.
        depths: blocks on the way down at each level; the way up has one block at each level but the coarsest.
        group_width: channels that share an attention weight.
    """

    inputs: int = POINT_FEATURES
    widths: tuple[int, ...] = (48, 64, 96)
    depths: tuple[int, ...] = (1, 1, 1)
    group_width: int = 8


class Backbone(nn.Module):
    """Graph (features of the finest level) -> (M, widths[0])."""

    def __init__(self, config: BackboneConfig):
        super().__init__()
        widths, groups = config.widths, [w // config.group_width for w in config.widths]
        self.embed = nn.Sequential(nn.Linear(config.inputs, widths[0]), nn.LayerNorm(widths[0]), nn.SiLU())
        self.down_blocks = nn.ModuleList(
            GraphBlocks(w, g, depth) for w, g, depth in zip(widths, groups, config.depths, strict=True)
        )
        steps = list(pairwise(widths))
        self.down = nn.ModuleList(nn.Sequential(nn.Linear(a, b), nn.LayerNorm(b)) for a, b in steps)
        self.up = nn.ModuleList(nn.Sequential(nn.Linear(b, a), nn.LayerNorm(a)) for a, b in steps)
        self.up_blocks = nn.ModuleList(GraphBlock(a, a // config.group_width) for a, _ in steps)

    def forward(self, graph: Graph, features: Tensor | None = None) -> Tensor:
        """Features (M, widths[0]) of the finest level.

        Args:
            graph: a batch of clouds.
            features: (M, inputs); the graph's own if None.
        """
        relations = [level_relations(level) for level in graph.levels]
        x: Tensor = self.embed(graph.features if features is None else features)
        skips = []
        for k, (level, blocks) in enumerate(zip(graph.levels, self.down_blocks, strict=True)):
            x = blocks(x, level.neighbours, relations[k])
            if level.parent is not None:
                skips.append(x)
                x = pool_max(self.down[k](x), level.parent, len(graph.levels[k + 1].points))
        for k in reversed(range(len(skips))):
            parent = graph.levels[k].parent
            assert parent is not None
            merged: Tensor = skips[k] + gather(self.up[k](x), parent)
            x = self.up_blocks[k](merged, graph.levels[k].neighbours, relations[k])
        return x


def level_relations(level: Level) -> Tensor:
    """(M, K, RELATION) of each point to its neighbours."""
    p, n, near = level.points, level.normals, level.neighbours
    return relation(p[:, None], n[:, None], p[near], n[near])
