from dataclasses import replace

import numpy as np
import pytest

from imop.evaluation.trials import Trial
from imop.geometry import se3
from imop.geometry.view_alignment import corrected, disagreement, find_errors
from imop.sim.depth_noise import DepthNoise


@pytest.fixture(scope="module")
def scene():
    return Trial("tabletop/open_drawer", 0).env().observation.stripped()


def misplaced(observation, distance=0.003, degrees=0.5, seed=1):
    rng = np.random.default_rng(seed)
    errors = {
        name: se3.make(se3.euler(*rng.normal(0, np.radians(degrees), 3)), rng.normal(0, distance, 3))
        for name in observation.views
    }
    return corrected(observation, errors)


def test_views_that_agree_are_left_as_they_are(scene):
    for T in find_errors([scene]).values():
        np.testing.assert_array_equal(T, np.eye(4))


def test_noise_is_no_disagreement(scene):
    noisy = DepthNoise(0.06, 0.05, 0.5, 0.05)(scene, np.random.default_rng(0))
    for T in find_errors([noisy]).values():
        assert np.linalg.norm(T[:3, 3]) < 0.002 and se3.rotation_distance(T, np.eye(4)) < np.radians(0.15)


def test_misplaced_views_are_brought_together(scene):
    seen = misplaced(scene)
    right = corrected(seen, find_errors([seen]))
    assert disagreement(right) < 0.1 * disagreement(seen)


def test_errors_that_are_known_are_kept(scene):
    seen = misplaced(scene)
    errors = find_errors([seen])
    again = find_errors([seen], errors)
    assert all(np.array_equal(again[name], errors[name]) for name in errors)


def test_the_scene_as_a_whole_stays(scene):
    """What all cameras have wrong alike cannot be seen, and is not guessed."""
    moved = {
        name: replace(view, T_world_camera=se3.make(p=(0.02, 0.0, 0.01)) @ view.T_world_camera)
        for name, view in scene.views.items()
    }
    for T in find_errors([replace(scene, views=moved)]).values():
        np.testing.assert_array_equal(T, np.eye(4))


def test_a_single_view_and_views_of_nothing_stay(scene):
    one = replace(scene, views={"front": scene.views["front"]})
    np.testing.assert_array_equal(find_errors([one])["front"], np.eye(4))
    blind = {name: replace(view, depth=np.zeros_like(view.depth)) for name, view in scene.views.items()}
    for T in find_errors([replace(scene, views=blind)]).values():
        np.testing.assert_array_equal(T, np.eye(4))
    assert np.isnan(disagreement(replace(scene, views=blind)))


def test_only_cameras_with_known_errors_are_corrected(scene):
    T = se3.make(p=(0.001, 0.0, 0.0))
    changed = corrected(scene, {"front": T})
    np.testing.assert_allclose(
        changed.views["front"].T_world_camera, scene.views["front"].T_world_camera @ T, atol=1e-12
    )
    assert changed.views["wrist"] is scene.views["wrist"]
