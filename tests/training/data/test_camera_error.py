from dataclasses import replace

import numpy as np
import pytest

from imop.geometry import se3
from imop.training.data.camera_error import BAD, camera_errors
from imop.training.data.pairs import Carry
from tests.training.data.test_pairs import pair


def three_views():
    """The pair as three cameras have seen it, every one some points everywhere."""
    before = pair()

    def shared(cloud):
        camera = np.arange(len(cloud)) % 3
        return replace(cloud, camera=camera.astype(cloud.camera.dtype))

    clouds = {name: shared(getattr(before, name)) for name in ("support", "after", "query")}
    return replace(before, **clouds)


def motions(before, changed):
    """Of each camera the rigid motion of its points, and how far the farthest of them went."""
    for camera in range(3):
        own = before.camera == camera
        p, q = before.points[own], changed.points[own]
        U, _, Vt = np.linalg.svd((q - q.mean(0)).T @ (p - p.mean(0)))
        R = U @ np.diag([1, 1, np.linalg.det(U @ Vt)]) @ Vt
        np.testing.assert_allclose((p - p.mean(0)) @ R.T, q - q.mean(0), atol=1e-12)
        np.testing.assert_allclose(before.normals[own] @ R.T, changed.normals[own], atol=1e-9)
        yield se3.make(R, q.mean(0) - R @ p.mean(0)), np.abs(q - p).max()


@pytest.mark.parametrize("seed", range(4))
def test_each_view_moves_rigidly_with_its_normals_and_a_little(seed):
    before, changed = three_views(), camera_errors(three_views(), np.random.default_rng(seed))
    for name in ("support", "after", "query"):
        moves = list(motions(getattr(before, name), getattr(changed, name)))
        assert all(0 < distance < 5 * (BAD[0] + BAD[1]) for _, distance in moves)
        assert not np.allclose(moves[0][0], moves[1][0], atol=1e-6)


def test_the_demonstration_has_one_error_and_the_query_mostly_the_same():
    before, same = three_views(), []
    for seed in range(30):
        changed = camera_errors(before, np.random.default_rng(seed))
        support, after, query = (
            np.stack([T for T, _ in motions(getattr(before, n), getattr(changed, n))])
            for n in ("support", "after", "query")
        )
        np.testing.assert_allclose(support, after, atol=1e-9)
        same.append(np.allclose(support, query, atol=1e-9))
    assert 15 < sum(same) < 30


def test_what_is_right_stays_and_is_still_right():
    before = three_views()
    for seed in range(10):
        changed = camera_errors(before, np.random.default_rng(seed))
        np.testing.assert_array_equal(changed.T_query_support, before.T_query_support)
        np.testing.assert_array_equal(changed.T_world_goal, before.T_world_goal)
        np.testing.assert_array_equal(changed.region, before.region)


def test_a_camera_without_points_is_no_harm():
    before = three_views()
    kept = before.support.camera != 1
    shown = replace(before, support=before.support.select(kept), region=before.region[kept])
    changed = camera_errors(shown, np.random.default_rng(0))
    assert len(changed.support) == len(shown.support) and len(changed.query) == len(before.query)


def test_a_view_that_only_the_next_carry_shows_moves_too():
    before = three_views()
    hands = np.stack([before.T_world_now, before.T_world_goal])
    later = replace(before.after, camera=before.after.camera + 1)
    changed = camera_errors(replace(before, carry=Carry(later, hands)), np.random.default_rng(0))
    assert changed.carry is not None
    moved = np.linalg.norm(changed.carry.after.points - later.points, axis=1)
    assert all(moved[later.camera == camera].max() > 0 for camera in (1, 2, 3))
    np.testing.assert_array_equal(changed.carry.T_world_hand, hands)
