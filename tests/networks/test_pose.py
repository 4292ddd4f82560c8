import numpy as np
import pytest
import torch

from imop.geometry import se3
from imop.networks.backbone import BackboneConfig
from imop.networks.graph import build_graph, collate
from imop.networks.matching import Correspondence
from imop.networks.pose import MatchedPose, PoseConfig, RegressedPose, pose_network
from tests.networks.scenes import SMALL, tabletop
from tests.networks.test_networks import GOAL, NOW, batch, step, turned

CONFIG = PoseConfig("regressed", width=16, backbone=BackboneConfig(widths=(16, 16, 16)), heads=2)
MOTION = se3.make(se3.euler(z=1.1), (0.2, -0.1, 0.0))
SHIFT = se3.make(p=(0.2, -0.1, 0.05))


@pytest.fixture(autouse=True)
def seeded():
    torch.manual_seed(0)


def tensor(T):
    return torch.from_numpy(np.array(T)).float()


def correspondence(rows=(20,), columns=(30,)):
    """Ragged matches between random points of about a scene's size."""
    size, r, q = len(rows), max(rows), max(columns)
    region = torch.arange(r) < torch.tensor(rows)[:, None]
    query = torch.arange(q) < torch.tensor(columns)[:, None]
    matrix = torch.rand(size, r, q) * region[:, :, None] * query[:, None]
    return Correspondence(
        [matrix], 0.1 * torch.randn(size, r, 3), 0.1 * torch.randn(size, q, 3), region, query
    )


def moved(found, T_region, T_query):
    def apply(T, p):
        return p @ tensor(T)[:3, :3].T + tensor(T)[:3, 3]

    p, q = apply(T_region, found.p_region), apply(T_query, found.p_query)
    return Correspondence(found.layers, p, q, found.region, found.query)


def test_matched_pose_follows_the_query_and_not_the_demonstration():
    network, found = MatchedPose(16), correspondence()
    here = network(found, tensor(GOAL)[None])
    there = network(moved(found, MOTION, SHIFT), tensor(MOTION @ GOAL)[None])
    torch.testing.assert_close(there, tensor(SHIFT) @ here, atol=1e-5, rtol=0)


def test_matched_pose_knows_no_order_of_the_points():
    network, found = MatchedPose(16), correspondence()
    a, b = torch.randperm(20), torch.randperm(30)
    other = Correspondence(
        [found.last[:, a][:, :, b]],
        found.p_region[:, a],
        found.p_query[:, b],
        found.region[:, a],
        found.query[:, b],
    )
    goal = tensor(GOAL)[None]
    torch.testing.assert_close(network(other, goal), network(found, goal), atol=1e-5, rtol=0)


def test_matched_pose_of_a_ragged_batch_is_that_of_its_samples():
    network, found = MatchedPose(16), correspondence((20, 7), (12, 30))
    goals = torch.stack([tensor(GOAL), tensor(NOW)])
    together = network(found, goals)
    for b, (r, q) in enumerate(((20, 12), (7, 30))):
        one = slice(b, b + 1)
        alone = Correspondence(
            [found.last[one, :r, :q]],
            found.p_region[one, :r],
            found.p_query[one, :q],
            found.region[one, :r],
            found.query[one, :q],
        )
        torch.testing.assert_close(network(alone, goals[one]), together[one], atol=1e-5, rtol=0)


def test_matched_pose_without_any_confidence_is_a_pose():
    found = correspondence()
    nothing = Correspondence([0 * found.last], found.p_region, found.p_query, found.region, found.query)
    assert torch.isfinite(MatchedPose(16)(nothing, tensor(GOAL)[None])).all()


def test_regressed_pose_follows_translations_of_the_query_and_not_the_demonstration():
    before, query = build_graph(tabletop(0), SMALL), build_graph(tabletop(1), SMALL)
    network = RegressedPose(CONFIG)
    here = network(step(before, before), query)
    elsewhere = turned(before, MOTION)
    there = network(step(elsewhere, elsewhere, MOTION @ GOAL, MOTION @ NOW), turned(query, SHIFT))
    torch.testing.assert_close(there, tensor(SHIFT) @ here, atol=1e-4, rtol=0)


def test_regressed_pose_of_a_ragged_batch_is_that_of_its_samples():
    graphs = [build_graph(tabletop(s), SMALL) for s in (0, 1, 2)]
    graphs.append(build_graph(tabletop(3).select(np.arange(850, 1100)), SMALL))
    steps = [step(graphs[0], graphs[0]), step(graphs[3], graphs[3], NOW, GOAL)]
    network = RegressedPose(CONFIG)
    together = network(batch(steps), collate([graphs[1], graphs[2]]))
    for b in range(2):
        torch.testing.assert_close(together[b], network(steps[b], graphs[1 + b])[0], atol=1e-5, rtol=0)


@pytest.mark.parametrize("seed", range(3))
def test_what_is_regressed_is_a_rigid_motion(seed):
    torch.manual_seed(seed)
    T = MatchedPose(16)(correspondence((20, 5), (30, 8)), torch.stack([tensor(GOAL)] * 2))
    R = T[:, :3, :3]
    torch.testing.assert_close(R @ R.mT, torch.eye(3).expand(2, 3, 3), atol=1e-5, rtol=0)
    torch.testing.assert_close(torch.linalg.det(R), torch.ones(2))
    assert (T[:, 3] == torch.tensor([0.0, 0, 0, 1])).all()


def test_every_parameter_of_both_learns():
    before, query = build_graph(tabletop(0), SMALL), build_graph(tabletop(1), SMALL)
    matched, regressed = MatchedPose(16), RegressedPose(CONFIG)
    matched(correspondence(), tensor(GOAL)[None])[:, :3].square().sum().backward()
    regressed(step(before, before), query)[:, :3].sin().sum().backward()
    for network in (matched, regressed):
        silent = [name for name, p in network.named_parameters() if p.grad is None or not p.grad.any()]
        assert not silent


def test_least_squares_has_no_network():
    assert pose_network(PoseConfig()) is None
    assert isinstance(pose_network(PoseConfig("from_matches")), MatchedPose)
    assert isinstance(pose_network(CONFIG), RegressedPose)
