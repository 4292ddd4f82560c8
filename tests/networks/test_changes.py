"""What changed between two states."""

import numpy as np

from imop.geometry import se3
from imop.geometry.cloud import concatenate
from imop.networks.changes import CHANGES, change_graph, compared
from tests.networks.scenes import SMALL, box_surface, moved, tabletop

THING = box_surface(
    np.random.default_rng(3), np.array([0.1, -0.15, 0.785]), (0.05, 0.05, 0.07), (0, 1, 0), 500
)
EMPTY, THERE = compared(tabletop()), compared(concatenate([tabletop(), THING]))


def near_thing(graph):
    return np.linalg.norm(graph.points.numpy() - THING.points.mean(axis=0), axis=1) < 0.07


def test_nothing_changes_where_nothing_happens():
    again = compared(concatenate([tabletop(7), THING]))
    graph, change = change_graph(THERE, again, SMALL)
    assert change.shape == (len(graph.points), CHANGES)
    assert not change[:, 2].any() and change[:, 0].max() < 0.5


def test_what_came_is_new_and_what_went_stays_in_the_cloud():
    """Below a centimetre things are taken for the table."""
    graph, change = change_graph(THERE, EMPTY, SMALL)
    raised = near_thing(graph) & (graph.points[:, 2].numpy() > 0.765)
    assert raised.sum() > 5 and change[raised, 0].min() > 0.2 and not change[:, 2].any()
    graph, change = change_graph(EMPTY, THERE, SMALL)
    gone = change[:, 2].numpy() > 0
    assert gone.sum() > 5 and near_thing(graph)[gone].all()


def test_a_turned_thing_shows_in_its_normals():
    center = se3.make(p=(0.1, -0.15, 0))
    quarter = center @ se3.make(se3.euler(z=np.pi / 4)) @ se3.invert(center)
    turned = compared(concatenate([tabletop(), moved(THING, quarter)]))
    (graph, change), (_, still) = change_graph(turned, THERE, SMALL), change_graph(THERE, THERE, SMALL)
    sides = near_thing(graph) & (np.abs(graph.levels[0].normals[:, 2].numpy()) < 0.3)
    assert change[sides, 1].mean() > 0.15 > 3 * still[:, 1].mean()


def test_changes_move_with_the_scene():
    """Grids begin elsewhere, so that the points are others; how much is new hardly changes."""
    T = se3.make(se3.euler(z=0.9), (0.1, -0.2, 0))
    there = [compared(moved(cloud, T)) for cloud in (THERE, EMPTY)]
    (_, a), (_, b) = change_graph(THERE, EMPTY, SMALL), change_graph(*there, SMALL)
    np.testing.assert_allclose((a[:, 0] > 0.4).float().mean(), (b[:, 0] > 0.4).float().mean(), atol=0.05)
