import numpy as np
import pytest

from imop.geometry import se3
from imop.geometry.neighbours import nearest
from imop.training.augment import JITTER, MOVE, augment
from tests.training.test_pairs import MOTION, pair


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


def test_the_gripper_moves_with_its_scene():
    before, changed = pair(), augment(pair(), np.random.default_rng(3))
    relative = se3.invert(before.T_world_now) @ before.T_world_goal
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
        shift = changed.T_world_goal[:2, 3] - pair().T_world_goal[:2, 3]
        assert np.abs(shift).max() < MOVE + 0.01
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
