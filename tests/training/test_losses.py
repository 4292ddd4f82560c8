import math

import pytest
import torch

from imop.training import losses

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
    assert losses.routing(scores, torch.tensor([1])).item() == pytest.approx(
        -0.0625 * math.log(0.75), rel=1e-5
    )
    missing = torch.tensor([[0.0, -1e9]])
    assert losses.routing(missing, torch.tensor([0])).item() == 0
