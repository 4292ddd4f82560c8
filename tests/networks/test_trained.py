"""Properties of the whole prediction, of networks that learned enough for a definite answer."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from imop.geometry import se3
from imop.geometry.cloud import concatenate
from imop.networks.backbone import BackboneConfig
from imop.networks.graph import GraphConfig
from imop.networks.matching import MatchingConfig, MatchingNetwork, reposition
from imop.networks.region import REGION_INPUTS, RegionConfig, RegionNetwork
from imop.training.data.augment import augment
from imop.training.data.pairs import StepPair, collate_samples, make_sample
from imop.training.loop import losses
from tests.networks.scenes import box_surface, moved, tabletop
from tests.networks.test_networks import GOAL, NOW, permuted, turned

GRAPH = GraphConfig(max_points=200, grids=(0.05,))
REGION = RegionConfig(BackboneConfig(REGION_INPUTS, (16, 16), (1, 1)), stages=1)
MATCHING = MatchingConfig(BackboneConfig(widths=(16, 16), depths=(1, 1)), layers=2, max_region=60)
SPACING = 0.017
"""Between neighbours above the table when these scenes are thinned to 200 points, metres."""
YAWS = (-2.5, -0.9, 0.4, 1.6)


def corner(seed):
    """A table with three coloured bars that meet, so that every point and every turn is recognisable."""
    rng = np.random.default_rng(seed)
    table = tabletop(seed)
    table = table.select(np.flatnonzero(table.points[:, 2] < 0.7501))
    bars = (
        ((0.06, 0.05, 0.81), (0.04, 0.04, 0.12), (0.9, 0.1, 0.1)),
        ((0.12, 0.05, 0.77), (0.08, 0.04, 0.04), (0.1, 0.8, 0.1)),
        ((0.06, 0.11, 0.77), (0.04, 0.08, 0.04), (0.9, 0.8, 0.1)),
        ((-0.12, -0.1, 0.77), (0.12, 0.08, 0.04), (0.1, 0.2, 0.9)),
    )
    return concatenate([table, *(box_surface(rng, np.array(c), size, color, 300) for c, size, color in bars)])


def pair(seed):
    """The bars but the last belong to the step; the query is the same scene, turned."""
    support, T = corner(seed), se3.make(se3.euler(z=0.7), (0.02, -0.03, 0.0))
    region = (support.points[:, 2] > 0.755) & (support.points[:, 0] > 0)
    return StepPair(support, corner(seed + 50), moved(support, T), region, GOAL, NOW, (True, False), T[None])


def sample(pair_):
    return make_sample(pair_, GRAPH, MATCHING.max_region, np.random.default_rng(0))


@pytest.fixture(scope="module")
def networks():
    """A region and a matching network after a short training on bars in all directions."""
    torch.manual_seed(0)
    rng = np.random.default_rng(0)
    samples = [sample(augment(pair(seed), rng)) for seed in range(8) for _ in range(2)]
    region, matching = RegionNetwork(REGION), MatchingNetwork(MATCHING)
    optimizer = torch.optim.Adam([*region.parameters(), *matching.parameters()], lr=1e-2)
    for k in range(60):
        batch = collate_samples([samples[(2 * k + i) % len(samples)] for i in range(2)])
        before = batch.step.before
        stages = region(batch.step).stages
        found = matching(batch.step, batch.chosen, batch.query)
        loss = losses.focal(stages[-1], batch.region, before.cloud, before.size)
        loss = loss + losses.dice(stages[-1], batch.region, before.cloud, before.size)
        loss = loss + losses.matching(found.layers, batch.targets)
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
    return region.eval(), matching.eval()


def predict(networks, batch):
    """Probability of the region (M,) and the gripper's pose in each query (B, 4, 4)."""
    with torch.no_grad():
        inside = torch.sigmoid(networks[0](batch.step).stages[-1].float())
        found = networks[1](batch.step, batch.chosen, batch.query)
    T = reposition(found.last, found.p_region, found.p_query)
    return inside, (T @ batch.step.T_world_goal).double().numpy()


def apart(T, right):
    """Metres and radians between two poses."""
    return float(se3.translation_distance(T, right)), float(se3.rotation_distance(T, right))


def carried(pair_, A, B):
    """The pair with the demonstration moved by A and the query by B."""
    return replace(
        pair_,
        support=moved(pair_.support, A),
        after=moved(pair_.after, A),
        query=moved(pair_.query, B),
        T_world_goal=A @ pair_.T_world_goal,
        T_world_now=A @ pair_.T_world_now,
        T_query_support=B @ pair_.T_query_support @ se3.invert(A),
    )


def motion(yaw):
    return se3.make(se3.euler(z=yaw), (0.3 * np.cos(yaw), 0.2 * np.sin(yaw), 0.0))


def test_it_has_learned(networks):
    """Without this the other tests would compare noise."""
    fresh = pair(30)
    inside, (T,) = predict(networks, collate_samples([sample(fresh)]))
    assert ((inside > 0.5) == (sample(fresh).region > 0.5)).float().mean() > 0.95
    distance, angle = apart(T, fresh.T_query_support[0] @ fresh.T_world_goal)
    assert distance < SPACING and angle < SPACING / 0.06


@pytest.mark.parametrize("yaw", YAWS)
def test_the_pose_follows_rigid_motions_of_both_scenes(networks, yaw):
    """Nothing that is searched for changes: what remains is rounding, magnified by the softmax of scores.

    Coordinates of a metre carry 1e-7 of rounding, lengths in units of 5 cm twenty times that, and a score is
    a sum over some hundred of these; the pose is their weighted mean. So 1e-4 is loose, and far below the
    millimetres that a frame that was forgotten somewhere would cost.
    """
    A, B = motion(yaw), motion(1 - 2 * yaw)
    one = sample(pair(30))
    there = replace(
        one,
        before=turned(one.before, A),
        after=turned(one.after, A),
        query=turned(one.query, B),
        poses=torch.from_numpy(A).float() @ one.poses,
    )
    inside, (T,) = predict(networks, collate_samples([one]))
    inside_there, (T_there,) = predict(networks, collate_samples([there]))
    torch.testing.assert_close(inside_there, inside, atol=1e-3, rtol=0)
    np.testing.assert_allclose(T_there, B @ T, atol=1e-4)


@pytest.mark.parametrize("yaw", YAWS)
def test_the_pose_of_moved_clouds_follows_within_their_spacing(networks, yaw):
    """Clouds are thinned on a grid that stands still, so other points remain of a cloud that moved.

    Then a match is off by up to the spacing of the points, and the fit by a share of that; what it turns by
    is an error of one spacing over the 6 cm from the bars' middle to their ends.
    """
    A, B = motion(yaw), motion(1 - 2 * yaw)
    fresh = pair(30)
    _, (T,) = predict(networks, collate_samples([sample(fresh)]))
    _, (T_there,) = predict(networks, collate_samples([sample(carried(fresh, A, B))]))
    distance, angle = apart(T_there, B @ T)
    assert distance < SPACING and angle < SPACING / 0.06


def test_predictions_follow_the_order_of_the_points(networks):
    one = sample(pair(31))
    generator = torch.Generator().manual_seed(0)
    of_before, of_query = (
        torch.randperm(len(g.points), generator=generator) for g in (one.before, one.query)
    )
    place = torch.empty_like(of_before)
    place[of_before] = torch.arange(len(of_before))
    other = replace(
        one,
        before=permuted(one.before, of_before),
        query=permuted(one.query, of_query),
        cross=one.cross[of_before],
        fate=one.fate[of_before],
        cross_back=place[one.cross_back],
        region=one.region[of_before],
        chosen=place[one.chosen],
    )
    inside, T = predict(networks, collate_samples([one]))
    inside_other, T_other = predict(networks, collate_samples([other]))
    torch.testing.assert_close(inside_other, inside[of_before], atol=1e-4, rtol=0)
    np.testing.assert_allclose(T_other, T, atol=1e-4)


def test_a_ragged_batch_predicts_what_its_samples_do(networks):
    fewer = pair(33)
    keep = np.r_[0:300, 900 : len(fewer.support)]
    fewer = replace(fewer, support=fewer.support.select(keep), region=fewer.region[keep])
    samples = [sample(pair(32)), sample(fewer), sample(pair(34))]
    assert len({len(s.before.points) for s in samples} | {len(s.chosen) for s in samples}) > 2
    inside, T = predict(networks, collate_samples(samples))
    alone = [predict(networks, collate_samples([s])) for s in samples]
    torch.testing.assert_close(inside, torch.cat([region for region, _ in alone]), atol=1e-4, rtol=0)
    np.testing.assert_allclose(T, np.concatenate([pose for _, pose in alone]), atol=1e-4)


def test_mixed_precision_predicts_nearly_the_same(networks):
    """bfloat16 has eight bits: a probability may move by some hundredths, a pose by less than the spacing."""
    batch = collate_samples([sample(pair(seed)) for seed in (30, 31, 32)])
    inside, T = predict(networks, batch)
    with torch.autocast("cpu", torch.bfloat16):
        mixed_inside, mixed_T = predict(networks, batch)
    assert (mixed_inside - inside).abs().mean() < 0.02
    assert ((mixed_inside > 0.5) == (inside > 0.5)).float().mean() > 0.97
    for a, b in zip(mixed_T, T, strict=True):
        distance, angle = apart(a, b)
        assert distance < SPACING / 2 and angle < SPACING / 0.06 / 2
