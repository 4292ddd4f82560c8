"""What routing sees of a state: its cloud, which of it is new since the state before, and what is gone.

A step that did what it should leaves a change in the scene. That change is seen as points that were not there
before, points that face another way, and points of the state before that nothing takes the place of any more,
which join the cloud.
"""

from dataclasses import replace

import numpy as np
import torch
from torch import Tensor

from imop.geometry.cloud import PointCloud, concatenate
from imop.geometry.neighbours import nearest
from imop.geometry.perception import Ground, find_ground
from imop.networks.graph import Graph, GraphConfig, build_graph, thin

CHANGES = 3
"""Distance to the state before, turn of the normal since then, and whether the point is gone."""
COMPARED = GraphConfig(voxel=0.014, plane_voxel=0.06, max_points=450)
"""How densely two states are compared; how far apart points of the same surface are depends on it."""
GONE = 0.03
# The bare plane is too thin to be compared.
_LOW = 0.01
_UNIT, _FAR = 0.05, 0.1


def compared(cloud: PointCloud, ground: Ground | None = None) -> PointCloud:
    """The cloud as densely as `change_graph` expects it; `ground` of the cloud, if it is known."""
    return thin(cloud, COMPARED, ground)[0]


def change_graph(now: PointCloud, before: PointCloud, config: GraphConfig) -> tuple[Graph, Tensor]:
    """Graph of a state with what is gone since the state before, and (M, CHANGES) what changed.

    Args:
        now: cloud of the state, as `compared` makes it.
        before: cloud of the state before; `now` itself if there is none.
        config: how the cloud becomes a graph.
    """
    ground = find_ground(now)
    gone = nearest(before.points, now.points)[0][:, 0] > GONE
    left = before.select(gone & (ground.height(before.points) > _LOW))
    everything = concatenate([now, left])
    bare = np.concatenate([ground.bare, np.zeros(len(left), dtype=bool)])
    graph = build_graph(everything, config, replace(ground, bare=bare))
    points, normals = graph.points.numpy().astype(np.float64), graph.levels[0].normals.numpy()
    distance, index = nearest(points, before.points)
    assert before.normals is not None
    turn = 1 - np.einsum("nk,nk->n", normals, before.normals[index[:, 0]])
    past = nearest(points, now.points)[0][:, 0] > 0.8 * GONE
    raised = graph.features[:, 3].numpy() * 0.2 > _LOW
    columns = [np.minimum(distance[:, 0], _FAR) / _UNIT, turn, past]
    return graph, torch.from_numpy((np.stack(columns, axis=1) * raised[:, None]).astype(np.float32))
