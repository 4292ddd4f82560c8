"""What stands around the gripper."""

import numpy as np
import torch

from imop.networks.graph import build_graph, collate
from imop.networks.surroundings import FIT, NEAREST, fit, surroundings
from tests.networks.scenes import SMALL, tabletop

GRAPH = build_graph(tabletop(), SMALL)


def around(center, gone=None):
    """Of two clouds that are the same."""
    graph = collate([GRAPH, GRAPH])
    local = graph.points - torch.tensor(center)
    none = torch.zeros(len(local))
    return surroundings(graph, local, local.norm(dim=1), none if gone is None else none + gone)


TALL, FLAT = (0.1, 0.05, 0.80), (-0.12, -0.1, 0.77)


def test_it_keeps_the_nearest_things_in_the_order_of_their_distance():
    found = around(TALL)
    assert found.shape == (2, NEAREST, 7)
    torch.testing.assert_close(found[0], found[1])
    things = found[0, found[0, :, 6] > 0]
    distance = things[:, :3].norm(dim=1)
    assert len(things) > 10 and (distance.diff() >= 0).all() and distance[0] < 0.06
    assert not around(TALL, gone=1.0)[..., 6].any()


def test_the_same_surroundings_fit_and_others_do_not():
    tall, flat = around(TALL), around(FLAT)
    same, other = fit(tall, tall), fit(tall, flat)
    assert same.shape == (2, FIT)
    torch.testing.assert_close(same.view(2, 2, 2, 3)[..., :2], torch.zeros(2, 2, 2, 2), atol=1e-3, rtol=0)
    assert (other.view(2, 2, 2, 3)[..., :2] > 0.1).all()
    np.testing.assert_allclose(other.view(2, 2, -1).flip(1).flatten(1), fit(flat, tall), atol=1e-6)


def test_a_missing_thing_is_missed_from_the_side_that_has_it():
    nothing = torch.zeros(2, NEAREST, 7)
    there, here = fit(around(TALL), nothing).view(2, 2, 2, 3).unbind(1)
    assert (there[..., :2] > 0.5).all() and not here.any()
