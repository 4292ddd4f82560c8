"""The paper's algorithm: Eq. (2) on exact matches, and the policy that it makes."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from imop.errors import CorruptData
from imop.geometry import se3
from imop.networks.matching import Correspondence
from imop.networks.model import SMALL, Model, load_model, save_model
from imop.policy.interfaces import Progress
from imop.policy.paper import PaperMatcher, least_squares, paper_policy
from imop.training.ablation import Ablation
from tests.policy.scenes import RED, TABLE, above, at, box, scene, transitions

HOME = above(0.0, -0.3, 1.2)
GRASP = above(0.1, 0.1, TABLE + 0.05)


@pytest.fixture(scope="module")
def matcher():
    return PaperMatcher(load_model())


def steps(T=None):
    T = np.eye(4) if T is None else T
    scenes = [scene([box((0.1, 0.05, 0.06), RED, T @ at(0.1, 0.1))], T @ pose) for pose in (HOME, GRASP)]
    return transitions(scenes, [(T @ GRASP, False)])


def matched(p, q, C):
    found = [torch.as_tensor(a, dtype=torch.float32)[None] for a in (C, p, q)]
    present = [torch.ones(1, len(a), dtype=torch.bool) for a in (p, q)]
    return Correspondence([found[0]], found[1], found[2], *present)


def test_exact_matches_give_the_motion(rng):
    T = at(0.3, -0.2, 0.1, yaw=1.1)
    p = rng.uniform(-0.1, 0.1, (20, 3))
    order = rng.permutation(20)
    fit = least_squares(matched(p, se3.apply(T, p)[order], np.eye(20)[:, order]))[0].numpy()
    np.testing.assert_allclose(fit, T, atol=1e-5)


def test_least_squares_is_over_all_pairs(rng):
    p, q, C = rng.uniform(-0.1, 0.1, (6, 3)), rng.uniform(0.0, 0.3, (9, 3)), rng.uniform(0, 1, (6, 9))
    fit = least_squares(matched(p, q, C))[0].numpy()

    def cost(T):
        return (C * ((se3.apply(T, p)[:, None] - q[None]) ** 2).sum(axis=2)).sum()

    nudges = [se3.make(se3.euler(*turn), shift) for turn, shift in rng.normal(0, 0.02, (40, 2, 3))]
    assert all(cost(fit) < cost(nudge @ fit) + 1e-6 for nudge in nudges)


def test_the_region_and_its_matches_are_points_of_the_scenes(matcher):
    step = matcher.prepare(steps())[0]
    query = steps(at(0.05, -0.08, 0.0, yaw=0.4))[0].before
    (found,) = step.locate(query)
    for some, whole in ((found.p_support, step.region), (found.p_query, query.cloud.points)):
        distance = np.linalg.norm(some[:, None] - whole[None], axis=2).min(axis=1)
        # Points of a graph are means of a few of the cloud.
        assert len(some) and distance.max() < 0.01


def test_an_unchanged_scene_is_recognised(matcher):
    (found,) = matcher.prepare(steps())[0].locate(steps()[0].before)
    assert se3.translation_distance(found.T_query_support @ GRASP, GRASP) < 0.02
    assert 0 < found.probability <= 1


def test_what_was_done_before_changes_nothing(matcher):
    step, query = matcher.prepare(steps())[0], steps(at(0.05, -0.08, 0.0))[0].before
    hinted = step.locate(query, Progress(at(0.4, 0.4, 0.0)))[0]
    np.testing.assert_array_equal(hinted.T_query_support, step.locate(query)[0].T_query_support)


def test_one_candidate_is_said_to_be_out_of_reach_and_stays(matcher):
    (found,) = matcher.prepare(steps())[0].locate(steps()[0].before, feasible=lambda T: False)
    assert found.reachable is False


@pytest.mark.parametrize("pose", ["from_matches", "regressed"])
def test_a_regressed_pose_follows_a_moved_demonstration(pose):
    """Whatever the weights: T_query_support undoes the motion of the demonstration."""
    torch.manual_seed(0)
    model = Model(Ablation(pose=pose).of(SMALL)).eval()
    # Untrained regions differ by rounding, so every point may be matched.
    matcher = PaperMatcher(model, threshold=0.0)
    query = steps()[0].before
    (here,), (there,) = (matcher.prepare(steps(T))[0].locate(query) for T in (np.eye(4), at(0.1, 0, 0)))
    T_here, T_there = here.T_query_support @ GRASP, there.T_query_support @ at(0.1, 0, 0) @ GRASP
    assert se3.translation_distance(T_here, T_there) < 0.05
    assert se3.rotation_distance(T_here, T_there) < 0.3


def test_without_regions_the_whole_state_is_matched():
    model = load_model()
    matching = replace(model.config.matching, region_first=False)
    model.config = replace(model.config, matching=matching)
    p = PaperMatcher(model).prepare(steps())[0].region
    assert np.ptp(p[:, 0]) > 0.6, "the table is 80 cm long"


def test_weights_without_routing_are_refused(tmp_path):
    save_model(Model(SMALL), tmp_path, {})
    with pytest.raises(CorruptData, match="routing"):
        paper_policy(tmp_path)
