from dataclasses import replace

import numpy as np
import torch

from imop.geometry import se3
from imop.networks.graph import (
    POINT_FEATURES,
    RADII,
    GraphConfig,
    build_graph,
    collate,
    local_statistics,
    thin,
)
from tests.networks.scenes import SMALL, moved, tabletop


def test_the_cap_holds_and_most_points_are_above_the_plane():
    fine, height = thin(tabletop(), SMALL)
    assert len(fine) <= SMALL.max_points
    assert np.count_nonzero(height > 0.01) > len(fine) / 2


def test_indices_stay_within_their_level():
    graph = build_graph(tabletop(), SMALL)
    assert graph.features.shape == (len(graph.points), POINT_FEATURES)
    for level, coarser in zip(graph.levels, [*graph.levels[1:], None], strict=True):
        m = len(level.points)
        assert level.neighbours.shape == (m, SMALL.neighbours)
        torch.testing.assert_close(level.neighbours[:, 0], torch.arange(m))
        if coarser is None:
            assert level.parent is None
        else:
            assert set(level.parent.tolist()) == set(range(len(coarser.points)))


def test_a_parent_is_the_mean_of_its_points():
    fine, coarse = build_graph(tabletop(), SMALL).levels[:2]
    for cell in range(len(coarse.points)):
        torch.testing.assert_close(
            coarse.points[cell], fine.points[fine.parent == cell].mean(dim=0), atol=1e-5, rtol=0
        )


def test_a_batch_is_its_clouds_side_by_side():
    graphs = [build_graph(tabletop(seed), SMALL) for seed in (0, 1, 2)]
    batch = collate(graphs)
    assert batch.size == 3
    start = [0, 0, 0]
    for number, graph in enumerate(graphs):
        for k, level in enumerate(graph.levels):
            here = batch.levels[k].cloud == number
            torch.testing.assert_close(batch.levels[k].points[here], level.points)
            torch.testing.assert_close(batch.levels[k].neighbours[here] - start[k], level.neighbours)
            if level.parent is not None:
                torch.testing.assert_close(batch.levels[k].parent[here] - start[k + 1], level.parent)
        start = [s + len(level.points) for s, level in zip(start, graph.levels, strict=True)]


def test_statistics_do_not_change_under_yaw_and_translation():
    cloud, _ = thin(tabletop(), SMALL)
    T = se3.make(se3.euler(z=0.8), (0.3, -0.2, 0.1))
    other = moved(cloud, T)
    for radius in RADII:
        np.testing.assert_allclose(
            local_statistics(other.points, other.normals, radius),
            local_statistics(cloud.points, cloud.normals, radius),
            atol=1e-6,
        )


def test_a_lonely_point_has_finite_statistics():
    found = local_statistics(np.zeros((1, 3)), np.array([[0.0, 0, 1]]), 0.05)
    assert np.all(np.isfinite(found)) and found[0, 0] == 0


def test_a_cloud_of_one_point_makes_a_graph():
    cloud = tabletop().select(np.array([950]))
    graph = build_graph(cloud, SMALL)
    assert all(len(level.points) == 1 for level in graph.levels)
    assert graph.levels[0].neighbours.tolist() == [[0] * SMALL.neighbours]


def test_the_plane_is_thinned_and_not_deleted():
    cloud = tabletop()
    fine, height = thin(cloud, SMALL)
    bare = (np.abs(height) < 0.008) & (np.abs(fine.colors - 0.6) < 0.01).all(axis=1)
    before = np.count_nonzero(cloud.points[:, 2] < 0.7501)
    assert 0 < bare.sum() <= SMALL.max_points / 3 < before
    assert np.ptp(fine.points[bare, :2], axis=0).min() > 0.4


def test_a_mark_on_the_plane_keeps_its_points():
    cloud = tabletop()
    mark = (np.linalg.norm(cloud.points[:, :2] - (0.2, -0.2), axis=1) < 0.05) & (cloud.points[:, 2] < 0.7501)
    marked = replace(cloud, colors=np.where(mark[:, None], np.float32([0.9, 0, 0]), cloud.colors))
    inside = [
        np.sum(np.linalg.norm(thin(c, GraphConfig())[0].points[:, :2] - (0.2, -0.2), axis=1) < 0.05)
        for c in (cloud, marked)
    ]
    assert inside[1] > 2 * inside[0] > 0
