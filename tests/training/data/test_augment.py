from dataclasses import replace

import numpy as np
import pytest

from imop.geometry import se3
from imop.geometry.neighbours import nearest
from imop.training.data.augment import JITTER, MOVE, augment, mirrored
from imop.training.data.pairs import Carry
from tests.training.data.test_pairs import MOTION, pair


@pytest.mark.parametrize("seed", range(4))
def test_the_truth_moves_with_the_scenes(seed):
    changed = augment(pair(), np.random.default_rng(seed))
    region = changed.support.points[changed.region]
    distance, index = nearest(se3.apply(changed.T_query_support[0], region), changed.query.points)
    # Most region points were kept on the other side as well.
    assert np.median(distance) < 0.01
    close = distance[:, 0] < 4 * JITTER
    turned = se3.rotate(changed.T_query_support[0], changed.support.normals[changed.region])
    facing = np.einsum("ij,ij->i", turned, changed.query.normals[index[:, 0]])
    assert close.sum() > 20 and np.median(facing[close]) > 0.999


MIRROR = np.diag([1.0, -1.0, 1.0, 1.0])


def test_a_mirrored_pair_is_still_true_and_mirrored_twice_the_same():
    before, changed = pair(), mirrored(pair())
    region = changed.support.points[changed.region]
    there = se3.apply(changed.T_query_support[0], region)
    twin = se3.apply(before.T_query_support[0], before.support.points[before.region])
    np.testing.assert_allclose(there, twin * (1, -1, 1), atol=1e-12)
    assert np.linalg.det(changed.T_world_goal[:3, :3]) == pytest.approx(1)
    closing = se3.rotate(before.T_world_goal, np.array([[0.0, 1.0, 0.0]]))
    np.testing.assert_allclose(
        se3.rotate(changed.T_world_goal, np.array([[0.0, -1.0, 0.0]])), closing * (1, -1, 1), atol=1e-12
    )
    np.testing.assert_array_equal(mirrored(changed).query.points, before.query.points)


@pytest.mark.parametrize("change", [mirrored, lambda p: augment(p, np.random.default_rng(0))])
def test_what_is_carried_next_moves_with_its_scene(change):
    before = pair()
    hands = np.stack([before.T_world_now, before.T_world_goal])
    changed = change(replace(before, carry=Carry(before.support, hands)))
    assert changed.carry is not None
    np.testing.assert_allclose(changed.carry.T_world_hand[0], changed.T_world_now, atol=1e-12)
    np.testing.assert_allclose(changed.carry.T_world_hand[1], changed.T_world_goal, atol=1e-12)
    distance, _ = nearest(changed.carry.after.points, changed.support.points)
    assert np.median(distance) < 0.01


def test_both_a_pair_and_its_mirror_image_are_drawn():
    relative = se3.invert(pair().T_world_now) @ pair().T_world_goal
    changed = [augment(pair(), np.random.default_rng(seed)) for seed in range(12)]
    moves = [se3.invert(c.T_world_now) @ c.T_world_goal for c in changed]
    same = [np.allclose(T, relative, atol=1e-9) for T in moves]
    flipped = [np.allclose(T, MIRROR @ relative @ MIRROR, atol=1e-9) for T in moves]
    assert all(a != b for a, b in zip(same, flipped, strict=True)) and any(same) and any(flipped)


def test_the_gripper_moves_with_its_scene():
    before, changed = pair(), augment(pair(), np.random.default_rng(3))
    relative = MIRROR @ se3.invert(before.T_world_now) @ before.T_world_goal @ MIRROR
    np.testing.assert_allclose(se3.invert(changed.T_world_now) @ changed.T_world_goal, relative, atol=1e-9)

    def closest(p):
        return nearest(p.T_world_goal[None, :3, 3], p.support.points[p.region])[0][0, 0]

    assert closest(changed) == pytest.approx(closest(before), abs=0.01)


def test_both_sides_move_independently_and_not_too_far():
    yaws = []
    for seed in range(30):
        changed = augment(pair(), np.random.default_rng(seed))
        T = changed.T_query_support[0] @ se3.invert(MOTION)
        yaws.append(np.arctan2(T[1, 0], T[0, 0]))
        sides = (pair(), mirrored(pair()))
        shifts = [changed.T_world_goal[:2, 3] - side.T_world_goal[:2, 3] for side in sides]
        assert min(np.abs(shift).max() for shift in shifts) < MOVE + 0.01
    assert np.ptp(yaws) > np.pi


def test_the_same_seed_gives_the_same_pair():
    first, second = (augment(pair(), np.random.default_rng(5)) for _ in range(2))
    np.testing.assert_array_equal(first.query.points, second.query.points)
    np.testing.assert_array_equal(first.region, second.region)


def test_colours_stay_colours_and_the_region_is_never_lost():
    for seed in range(30):
        changed = augment(pair(), np.random.default_rng(seed))
        assert changed.region.any() and len(changed.region) == len(changed.support)
        for cloud in (changed.support, changed.after, changed.query):
            assert cloud.colors.min() >= 0 and cloud.colors.max() <= 1


def test_labels_stay_with_their_points():
    before = pair()
    label = np.where(before.region, 1e-5 * np.arange(len(before.region)), np.nan)
    changed = augment(replace(before, invariance=label), np.random.default_rng(0))
    np.testing.assert_array_equal(np.isfinite(changed.invariance), changed.region)
    kept = changed.invariance[changed.region]
    assert np.isin(kept, label).all() and (np.diff(kept) > 0).all() and len(kept) < before.region.sum()
