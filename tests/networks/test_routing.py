from dataclasses import replace

import numpy as np
import pytest
import torch

from imop.geometry import se3
from imop.networks.backbone import BackboneConfig
from imop.networks.blocks import Standardized
from imop.networks.changes import CHANGES
from imop.networks.graph import build_graph, collate
from imop.networks.routing import INPUTS, RoutingConfig, RoutingNetwork, States
from tests.networks.scenes import SMALL, tabletop
from tests.networks.test_networks import GOAL, turned

ROUTING = RoutingConfig(BackboneConfig(INPUTS, widths=(16, 16, 16)), width=32)
GRAPHS = [build_graph(tabletop(s), SMALL) for s in range(5)]


@pytest.fixture(autouse=True)
def seeded():
    torch.manual_seed(0)


def states(graphs, T=GOAL, opening=None):
    """States with the gripper at `T`, the first ones more open, every point as new as its number."""
    graph = collate(graphs)
    change = torch.rand(len(graph.points), CHANGES, generator=torch.Generator().manual_seed(1))
    poses = torch.from_numpy(np.stack([[T, T]] * len(graphs)).astype(np.float32))
    opened = torch.linspace(1.0, 0.0, len(graphs)) if opening is None else torch.tensor(opening)
    return States(graph, change, poses, torch.stack([opened, opened], dim=1))


def scores(network, shown, query, expected=1):
    """Of one demonstration for one query."""
    owner = torch.zeros(len(shown.opening), dtype=torch.int64)
    return network(shown, owner, query, owner[:1], torch.tensor([expected]))[0]


def test_demonstrations_of_different_length_do_not_mix():
    network = RoutingNetwork(ROUTING).eval()
    shown, query = states(GRAPHS[:3], opening=[1.0, 0.5, 0.7]), states(GRAPHS[3:])
    owner, of, expected = torch.tensor([0, 0, 1]), torch.tensor([0, 1]), torch.tensor([1, 0])
    found, present = network(shown, owner, query, of, expected)
    assert present.tolist() == [[True, True], [True, False]]
    described = network.describe(shown), network.describe(query)
    d = described[0]
    first = replace(d, scene=d.scene[:2], robot=d.robot[:2], around=d.around[:2])
    alone, _ = network.score(first, owner[:2], described[1], torch.zeros(2, dtype=torch.int64), expected)
    torch.testing.assert_close(found[0], alone[0], atol=1e-5, rtol=1e-4)
    assert found[1].softmax(0)[1] == 0


def test_it_does_not_notice_where_a_state_stands():
    """A turn about the vertical and a move along the table change no input; floats allow 1e-3 of a score."""
    T = se3.make(se3.euler(z=1.1), (0.2, -0.1, 0.0))
    network, shown = RoutingNetwork(ROUTING).eval(), states(GRAPHS[:2])
    here = scores(network, shown, states(GRAPHS[2:3]))
    there = scores(network, shown, states([turned(GRAPHS[2], T)], T @ GOAL))
    torch.testing.assert_close(there, here, atol=1e-3, rtol=1e-3)


@pytest.mark.parametrize("what", ["gripper", "opening", "change", "expected"])
def test_it_sees(what):
    network, shown, query = RoutingNetwork(ROUTING).eval(), states(GRAPHS[:2]), states(GRAPHS[2:3])
    other = {
        "gripper": states(GRAPHS[2:3], se3.make(p=(0.05, 0, 0)) @ GOAL),
        "opening": states(GRAPHS[2:3], opening=[0.0]),
        "change": States(query.graph, query.change * 0, query.T_world_gripper, query.opening),
        "expected": query,
    }[what]
    found = scores(network, shown, other, 2 if what == "expected" else 1)
    assert not torch.allclose(found, scores(network, shown, query), atol=1e-3)


def test_every_parameter_learns():
    network = RoutingNetwork(ROUTING).eval()
    scores(network, states(GRAPHS[:2]), states(GRAPHS[2:3]))[0, 0].backward()
    silent = [name for name, p in network.named_parameters() if p.grad is None or not p.grad.any()]
    assert not silent


def test_inputs_are_standardized_over_the_training_and_left_alone_afterwards():
    x = torch.randn(400, 3) * torch.tensor([1.0, 10.0, 0.3]) + torch.tensor([0.0, 5.0, -2.0])
    layer = Standardized(3)
    for part in x.split(100):
        layer(part)
    found = layer.eval()(x)
    torch.testing.assert_close(found.mean(dim=0), torch.zeros(3), atol=0.05, rtol=0)
    torch.testing.assert_close(found.std(dim=0), torch.ones(3), atol=0.1, rtol=0)
    torch.testing.assert_close(layer(x[:1]), found[:1])


def test_it_knows_whether_it_was_trained():
    network = RoutingNetwork(ROUTING)
    assert not network.trained
    network.describe(states(GRAPHS[:2]))
    assert network.trained
