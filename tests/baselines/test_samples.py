from dataclasses import replace

import numpy as np
import pytest

from imop.baselines.samples import CENTER, POINTS, joined, samples_of, stored_samples, thin
from imop.demos.store import DemonstrationStore
from imop.errors import CorruptData, InvalidInput
from imop.geometry.cloud import PointCloud
from imop.geometry.perception import Perception
from tests.baselines.conftest import some_samples
from tests.demos.scenes import lift_a_cube

PLAIN = Perception()


def told():
    return replace(lift_a_cube(), instructions=("lift the cube",))


def test_a_cloud_is_thinned_to_points_of_it_that_follow_each_other_closely():
    rng = np.random.default_rng(0)
    points = CENTER + rng.uniform(-0.5, 0.5, (9000, 3))
    steps, colors = thin(
        PointCloud(points, rng.random((9000, 3), dtype=np.float32), np.zeros(9000, np.int32))
    )
    thinned = CENTER + steps / (2**16 - 1) - 0.5
    assert steps.shape == colors.shape == (POINTS, 3)
    nearest = [np.abs(points - p).max(1).min() for p in thinned[::500]]
    assert max(nearest) < 2e-5
    successive = np.linalg.norm(np.diff(thinned, axis=0), axis=1)
    assert np.median(successive) < 0.2 * np.median(np.linalg.norm(thinned[:-50] - thinned[50:], axis=1)) * 2


def test_few_points_are_repeated():
    few = PointCloud(CENTER + np.eye(3) / 4, np.ones((3, 3), np.float32), np.zeros(3, np.int32))
    assert len(np.unique(thin(few)[0], axis=0)) == 3


def test_samples_tell_the_action_of_each_keyframe_in_the_middle_of_the_workspace():
    shown = told()
    samples = samples_of(PLAIN, shown)
    assert len(samples) == len(shown) and samples.instructions == ("lift the cube",)
    for row, keyframe in enumerate(shown.keyframes):
        np.testing.assert_allclose(
            samples.pose[row, :3, 3] + CENTER, keyframe.action.T_world_gripper[:3, 3], atol=1e-6
        )
        assert samples.gripper_open[row] == keyframe.action.gripper_open


def test_joined_samples_keep_their_instructions():
    both = joined([some_samples(4, 2), some_samples(3, 1)])
    assert len(both) == 7 and both.episode.tolist() == [0, 1, 0, 1, 2, 2, 2]
    assert len(both.instructions) == len(both.words) == 3 and both.of([2]).tolist() == [4, 5, 6]


def test_clouds_are_made_once(tmp_path, monkeypatch):
    store = DemonstrationStore.create(tmp_path / "demos.zarr")
    with pytest.raises(InvalidInput, match="empty"):
        stored_samples(tmp_path / "demos.zarr", tmp_path / "cache", PLAIN)
    store.append(told())
    first = stored_samples(tmp_path / "demos.zarr", tmp_path / "cache", PLAIN)
    monkeypatch.setattr("imop.baselines.samples.samples_of", None)
    again = stored_samples(tmp_path / "demos.zarr", tmp_path / "cache", PLAIN)
    assert np.array_equal(first.points, again.points) and first.instructions == again.instructions
    next((tmp_path / "cache").iterdir()).write_bytes(b"nonsense")
    with pytest.raises(CorruptData, match="remove it"):
        stored_samples(tmp_path / "demos.zarr", tmp_path / "cache", PLAIN)


def test_without_words_there_is_nothing_to_learn():
    with pytest.raises(InvalidInput, match="instructions"):
        samples_of(PLAIN, replace(lift_a_cube(), instructions=()))
