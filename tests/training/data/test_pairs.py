from dataclasses import replace

import numpy as np
import pytest
import torch

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.networks.matching import MatchingConfig, MatchingNetwork
from imop.networks.region import RegionNetwork
from imop.training.data.pairs import MATCH_RADIUS, StepPair, collate_samples, make_sample
from imop.training.loop import losses
from tests.networks.scenes import SMALL, moved, tabletop
from tests.networks.test_networks import GOAL, NOW, REGION, TINY

MOTION = se3.make(se3.euler(z=0.7), (0.02, -0.03, 0.0))


def pair(seed=0):
    support = tabletop(seed)
    region = support.colors[:, 0] > 0.8
    return StepPair(
        support, tabletop(seed + 50), moved(support, MOTION), region, GOAL, NOW, (True, False), MOTION[None]
    )


def sample(pair_, max_region=160):
    return make_sample(pair_, SMALL, max_region, np.random.default_rng(0))


def test_labels_are_those_of_the_cloud():
    made = sample(pair())
    red = made.before.features[:, 0] > 0.3
    torch.testing.assert_close(made.region > 0.5, red)
    assert red.sum() > 10
    torch.testing.assert_close(made.chosen, torch.nonzero(made.region)[:, 0])


def test_targets_lie_where_the_motion_carries_the_region():
    made = sample(pair())
    (pairs,) = made.targets
    assert len(pairs) > 0.8 * len(made.chosen)
    p = made.before.points[made.chosen][pairs[:, 0]].numpy()
    q = made.query.points[pairs[:, 1]].numpy()
    assert np.linalg.norm(se3.apply(MOTION, p) - q, axis=1).max() <= MATCH_RADIUS + 1e-6


def test_a_motion_that_hides_the_region_is_left_out():
    away = se3.make(p=(0, 0, 1.0))
    made = sample(replace(pair(), T_query_support=np.stack([away, MOTION])))
    assert len(made.targets) == 1 and len(made.targets[0])
    assert len(sample(replace(pair(), T_query_support=away[None])).targets[0]) == 0


def test_a_region_smaller_than_the_grid_keeps_a_point():
    tiny = np.zeros(len(pair().support), dtype=bool)
    tiny[1000] = True
    assert len(sample(replace(pair(), region=tiny)).chosen) >= 1


def test_equal_shapes_are_at_no_distance_from_each_other():
    made = sample(pair())
    inside = made.region > 0.5
    assert (made.invariance[inside] == 0).all() and torch.isnan(made.invariance[~inside]).all()


def test_what_has_no_counterpart_is_not_matched():
    equal = pair()
    left = equal.region & (equal.support.points[:, 0] < np.median(equal.support.points[equal.region, 0]))
    label = np.where(left, 2 * MATCH_RADIUS, np.where(equal.region, 0.001, np.nan))
    other = sample(replace(equal, invariance=label))
    far = other.invariance[other.chosen[other.targets[0][:, 0]]] > MATCH_RADIUS
    assert len(other.targets[0]) and not far.any()
    assert 0 < len(other.targets[0]) < len(sample(equal).targets[0])
    unknown = sample(replace(equal, invariance=np.full(len(label), np.nan)))
    torch.testing.assert_close(unknown.targets[0], sample(equal).targets[0])


def test_the_cap_on_region_points():
    assert len(sample(pair(), max_region=5).chosen) == 5


def test_without_a_region_the_whole_support_is_matched_and_only_its_region_has_targets():
    made = make_sample(pair(), SMALL, 60, np.random.default_rng(0), region_first=False)
    inside = made.region[made.chosen] > 0.5
    assert len(made.chosen) == 60 and 0 < inside.sum() < 60
    spread = made.before.points.numpy().max(axis=0) - made.before.points.numpy().min(axis=0)
    chosen = made.before.points[made.chosen].numpy()
    assert (np.ptp(chosen, axis=0) > 0.8 * spread).all()
    (pairs,) = made.targets
    assert len(pairs) > 0.5 * inside.sum() and inside[pairs[:, 0]].all()


def test_the_losses_of_a_batch_train_both_networks():
    batch = collate_samples([sample(pair(0)), sample(pair(1))])
    torch.manual_seed(0)
    region, matching = RegionNetwork(REGION), MatchingNetwork(MatchingConfig(TINY, layers=2))
    parameters = [*region.parameters(), *matching.parameters()]
    optimizer = torch.optim.Adam(parameters, lr=3e-3)
    history = []
    for _ in range(30):
        logits = region(batch.step).stages
        cloud, size = batch.step.before.cloud, batch.step.before.size
        found = matching(batch.step, batch.chosen, batch.query)
        loss = losses.focal(logits[-1], batch.region, cloud, size)
        loss = loss + losses.dice(logits[-1], batch.region, cloud, size)
        loss = loss + losses.matching(found.layers, batch.targets)
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        history.append(loss.item())
    assert history[-1] < 0.6 * history[0]


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"region": np.zeros(3, dtype=bool)}, "region"),
        ({"region": np.zeros(len(pair().support), dtype=bool)}, "region"),
        ({"invariance": np.zeros(3)}, "invariance"),
        ({"T_query_support": np.zeros((0, 4, 4))}, "T_query_support"),
        ({"T_query_support": 2 * np.eye(4)[None]}, "T_query_support"),
        ({"T_world_goal": np.eye(3)}, "T_world_goal"),
        ({"query": tabletop().select(np.zeros(0, dtype=int))}, "query"),
    ],
)
def test_bad_pairs_are_refused_by_name(changes, field):
    with pytest.raises(InvalidInput, match=field):
        replace(pair(), **changes)
