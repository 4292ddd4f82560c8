import numpy as np
import torch

from imop.baselines.batch import SHIFT, TURN, batch_of, random_motion
from imop.geometry import se3
from tests.baselines.conftest import some_samples


def test_cloud_gripper_and_target_move_together():
    samples = some_samples(4)
    still_in, still = batch_of(samples, np.arange(4))
    moved_in, moved = batch_of(samples, np.arange(4), np.random.default_rng(0))
    T = moved.pose @ torch.linalg.inv(still.pose)
    assert not torch.allclose(T, torch.eye(4).expand(4, 4, 4), atol=0.01)
    back = (moved_in.points - T[:, None, :3, 3]) @ T[:, :3, :3]
    torch.testing.assert_close(back, still_in.points, atol=1e-5, rtol=0)
    torch.testing.assert_close(T @ still_in.gripper, moved_in.gripper, atol=1e-5, rtol=0)
    assert torch.equal(moved_in.colors, still_in.colors)


def test_targets_stay_in_the_workspace_and_move_no_farther_than_allowed():
    rng = np.random.default_rng(0)
    for p in rng.uniform(-0.5, 0.5, (200, 3)):
        pose = se3.make(p=p).astype(np.float32)
        T = random_motion(pose, rng)
        moved = (T @ pose)[:3, 3]
        assert np.abs(moved).max() < 0.5 + 1e-6 and np.abs(moved - p).max() < SHIFT + 1e-6
        assert abs(se3.yaw(T)) < TURN + 1e-6 and T[2, 2] == 1


def test_a_target_outside_the_workspace_is_not_pulled_in():
    pose = se3.make(p=(0.0, 0.0, 0.55)).astype(np.float32)
    assert (random_motion(pose, np.random.default_rng(0)) @ pose)[2, 3] <= 0.55 + 1e-6
