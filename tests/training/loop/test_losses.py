import math

import numpy as np
import pytest
import torch

from imop.geometry import se3
from imop.training.loop import losses

ONE = torch.zeros(2, dtype=torch.int64)


def test_focal_by_hand():
    logits = torch.tensor([math.log(3.0), math.log(3.0)])
    target = torch.tensor([1.0, 0.0])
    expected = (0.25**2 * -math.log(0.75) + 0.75**2 * -math.log(0.25)) / 2
    assert losses.focal(logits, target, ONE, 1).item() == pytest.approx(expected, rel=1e-5)


def test_focal_counts_clouds_not_points():
    logits = torch.tensor([1.0, -2.0, 0.5])
    target = torch.tensor([1.0, 1.0, 0.0])
    alone = [
        losses.focal(logits[i], target[i], torch.zeros(len(i), dtype=torch.int64), 1) for i in ([0, 1], [2])
    ]
    together = losses.focal(logits, target, torch.tensor([0, 0, 1]), 2)
    torch.testing.assert_close(together, torch.stack(alone).mean())


def test_focal_of_a_perfect_answer_vanishes_and_extreme_logits_stay_finite():
    logits = torch.tensor([200.0, -200.0], requires_grad=True)
    right = losses.focal(logits, torch.tensor([1.0, 0.0]), ONE, 1)
    wrong = losses.focal(logits, torch.tensor([0.0, 1.0]), ONE, 1)
    assert right.item() == 0 and wrong.item() == pytest.approx(200)
    wrong.backward()
    assert torch.isfinite(logits.grad).all()


def test_dice_by_hand():
    logits = torch.tensor([math.log(3.0), -math.log(3.0), 0.0])
    cloud = torch.tensor([0, 0, 1])
    found = losses.dice(logits, torch.tensor([1.0, 0.0, 0.0]), cloud, 2)
    first = 1 - (2 * 0.75 + 1) / (1.0 + 1.0 + 1)
    second = 1 - 1 / (0.5 + 1)
    assert found.item() == pytest.approx((first + second) / 2, rel=1e-5)


def test_the_likeliest_spread_is_the_distance_and_unknown_points_have_no_gradient():
    distance = torch.tensor([0.002, 0.03, math.nan])
    expected = torch.tensor([0.002, 0.03, 0.01], requires_grad=True)
    losses.spread(expected, distance, torch.zeros(3, dtype=torch.int64), 1).backward()
    torch.testing.assert_close(expected.grad, torch.zeros(3))
    for factor in (0.5, 2.0):
        best, other = (
            losses.spread(s, distance, torch.zeros(3, dtype=torch.int64), 1)
            for s in (expected, factor * expected)
        )
        assert other > best


def test_clouds_that_show_the_same_thing_twice_say_nothing_about_the_spread():
    cloud, expected = torch.tensor([0, 0, 1, 1]), torch.tensor([0.01, 0.02, 0.03, 0.04])
    both = losses.spread(expected, torch.tensor([0.004, 0.0, 0.0, 0.0]), cloud, 2)
    alone = losses.spread(expected[:2], torch.tensor([0.004, 0.0]), cloud[:2], 1)
    torch.testing.assert_close(both, alone)
    assert losses.spread(expected, torch.zeros(4), cloud, 2).item() == 0


def test_matching_by_hand():
    matrix = torch.tensor([[[0.5, 0.1], [0.2, 0.9]]])
    pairs = torch.tensor([[0, 0], [1, 1]])
    expected = -(0.25 * math.log(0.5) + 0.01 * math.log(0.9)) / 2
    assert losses.matching([matrix], [[pairs]]).item() == pytest.approx(expected, rel=1e-5)
    assert losses.matching([matrix, matrix], [[pairs]]).item() == pytest.approx(2 * expected, rel=1e-5)


def test_of_several_right_motions_the_nearest_counts():
    matrix = torch.tensor([[[0.9, 0.05], [0.05, 0.9]]])
    straight, crossed = torch.tensor([[0, 0], [1, 1]]), torch.tensor([[0, 1], [1, 0]])
    one = losses.matching([matrix], [[straight]])
    assert losses.matching([matrix], [[crossed, straight]]) == one
    assert losses.matching([matrix], [[crossed]]) > 10 * one


def test_a_batch_in_which_nothing_is_visible_gives_zero_and_a_gradient():
    matrix = torch.full((1, 2, 2), 0.25, requires_grad=True)
    nothing = torch.zeros(0, 2, dtype=torch.int64)
    loss = losses.matching([matrix], [[nothing]])
    loss.backward()
    assert loss.item() == 0 and torch.all(matrix.grad == 0)


def test_routing_by_hand():
    scores = torch.log(torch.tensor([[1.0, 3.0]]))
    second = torch.tensor([[False, True]])
    assert losses.routing(scores, second).item() == pytest.approx(-0.0625 * math.log(0.75), rel=1e-5)
    missing = torch.tensor([[0.0, -1e9]])
    assert losses.routing(missing, ~second).item() == 0


def test_routing_takes_any_right_step():
    scores = torch.log(torch.tensor([[1.0, 3.0, 4.0]]))
    either = torch.tensor([[False, True, True]])
    assert losses.routing(scores, either).item() == pytest.approx(-((1 / 8) ** 2) * math.log(7 / 8), rel=1e-5)


def test_pose_by_hand():
    """5 cm are one unit; half a turn changes two columns by 2 each: |dR| = sqrt(8); and 0.5 is one unit."""
    right = torch.eye(4)[None]
    shifted = torch.eye(4)[None].clone()
    shifted[0, 0, 3] = 0.05
    half_turn = torch.from_numpy(se3.make(np.diag([-1.0, -1.0, 1.0]))).float()[None]
    assert losses.pose(right, [right]).item() == 0
    assert losses.pose(shifted, [right]).item() == pytest.approx(math.sqrt(2) - 1, rel=1e-5)
    assert losses.pose(half_turn, [right]).item() == pytest.approx(math.sqrt(1 + 8 / 0.25) - 1, rel=1e-5)


def test_the_nearest_right_pose_counts():
    right, other = torch.eye(4), torch.from_numpy(se3.make(np.diag([-1.0, -1.0, 1.0]), (0.3, 0, 0))).float()
    found = torch.stack([right, other])
    assert losses.pose(found, [torch.stack([other, right])] * 2).item() == 0
    assert losses.pose(found, [right[None], other[None]]).item() == 0
    assert losses.pose(found, [right[None]] * 2).item() > 1
