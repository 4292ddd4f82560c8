"""What stands around the gripper in a state, and whether the same stands around it in another.

After an action that did what was demonstrated, the gripper stands to the things it acted on as in the
demonstration, wherever they are. So two states are laid over each other by the gripper's pose, and nothing
has to be learned to see that a thing is missing, or another one is there.
"""

import torch
from torch import Tensor

from imop.networks.graph import Graph

NEAREST = 40
"""How many points around the gripper are kept."""
REACHES = (0.05, 0.12)
FIT = 6 * len(REACHES)
# Distances beyond this are all the same, metres; colours differ at most by this, per channel in the mean.
_FAR, _OTHER = 0.06, 0.3
_LOW = 0.01


def surroundings(graph: Graph, local: Tensor, distance: Tensor, gone: Tensor) -> Tensor:
    """(N, NEAREST, 7): position in the gripper's frame, colour, and 1 for things that are there, else 0.

    Args:
        graph: N clouds.
        local: (M, 3) points in the gripper's frame, metres.
        distance: (M,) from its origin.
        gone: (M,) more than 0 for points that are not there any more.
    """
    thing = (graph.features[:, 3] * 0.2 > _LOW) & (gone <= 0)
    ranked = distance + (~thing) * 10.0
    rows = torch.cat([local, graph.features[:, :3], thing[:, None].float()], dim=1)
    found = rows.new_zeros(graph.size, NEAREST, 7)
    counts = torch.bincount(graph.cloud, minlength=graph.size).tolist()
    parts = zip(torch.split(rows, counts), torch.split(ranked, counts), strict=True)
    for cloud, (part, rank) in enumerate(parts):
        nearest = rank.topk(min(NEAREST, len(part)), largest=False).indices
        found[cloud, : len(nearest)] = part[nearest]
    return found


def fit(a: Tensor, b: Tensor) -> Tensor:
    """(..., FIT) how well surroundings a and b (..., NEAREST, 7) agree, seen from each of both.

    For every reach and side: mean distance to the nearest point of the other, mean difference of its colour,
    both in units of their largest value, and how much there is.
    """
    distance = torch.cdist(a[..., :3], b[..., :3])
    a, b = (side.expand(*distance.shape[:-2], -1, -1) for side in (a, b))
    columns = []
    for here, other, apart in ((a, b, distance), (b, a, distance.mT)):
        apart = apart + 1 - other[..., None, :, 6]
        far, index = apart.min(dim=-1)
        color = other[..., 3:6].take_along_dim(index[..., None], -2)
        off = (here[..., 3:6] - color).abs().mean(dim=-1).clamp(max=_OTHER) / _OTHER
        far = far.clamp(max=_FAR) / _FAR
        off = torch.where(far < 1, off, 1.0)
        reach = here[..., :3].square().sum(dim=-1)
        for radius in REACHES:
            weight = here[..., 6] * torch.exp(-reach / radius**2)
            total = weight.sum(dim=-1)
            columns += [(weight * v).sum(dim=-1) / (total + 0.1) for v in (far, off)] + [total.log1p()]
    return torch.stack(columns, dim=-1)
