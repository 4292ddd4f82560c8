"""One search in one scene, on boxes: what is proposed, laid down, told apart, and when it ends."""

import numpy as np
import pytest
import torch

from imop.geometry import se3
from imop.networks.verification import EVIDENCE
from imop.policy.interfaces import BEGINNING, PolicyConfig, Progress, Scene, Tried
from imop.policy.proposals import Asked, Matches
from imop.policy.region import Region
from imop.policy.search import StepSearch
from imop.policy.verification import Verifier
from tests.policy.scenes import BLUE, RED, TABLE, above, at, box, marked_can, scene, transitions

HOME = above(0.0, -0.3, 1.2)
GRASP = above(0.1, 0.1, TABLE + 0.05)
SIZE = (0.1, 0.05, 0.06)
HERE, THERE = at(0.1, 0.1), at(0.3, -0.2, yaw=1.2)
T = THERE @ se3.invert(HERE)
CLOUD = box(SIZE, RED, HERE)
NOTHING = Matches(*(np.zeros((0, 3)) for _ in range(4)), np.zeros(0))


class Exact(torch.nn.Module):
    """What is explained exactly and in its colours is right."""

    def probability(self, evidence, rival):
        column = {name: evidence[:, k] for k, name in enumerate(EVIDENCE)}
        assert evidence.shape[1] == len(EVIDENCE) and rival.shape == (len(evidence), len(evidence))
        return (column["region_exact"] * column["region_color"] * column["backward_exact"]).clamp(0, 1)


def search(fits=None, matches=NOTHING, asked=None, **settings):
    region = Region(CLOUD, np.ones(len(CLOUD)), np.zeros((0, 3)), spread=np.full(len(CLOUD), 0.001))
    step = transitions([scene([CLOUD], HOME), scene([CLOUD], GRASP)], [(GRASP, False)])[0]

    def ask(query):
        if asked is not None:
            asked.append(query)
        return Asked(fits or {}, matches)

    return StepSearch(PolicyConfig(**settings), step, region, None, Verifier(Exact()), ask)


def query(*poses, T_world_gripper=HOME):
    return scene([box(SIZE, RED, pose, seed=1 + k) for k, pose in enumerate(poses)], T_world_gripper)


def off(candidate, pose=THERE):
    """Metres, and radians but for a half turn: the box has two."""
    angle = float(se3.rotation_distance(candidate.T_query_support @ HERE, pose))
    return se3.translation_distance(candidate.T_query_support @ HERE, pose), min(angle, np.pi - angle)


def test_a_fit_that_is_nearly_right_is_laid_down_exactly():
    found = search({"fit": at(0.008, -0.006, 0.0) @ T}).locate(query(THERE))
    distance, angle = off(found[0])
    assert distance < 0.003 and angle < 0.05 and found[0].probability > 0.8
    assert (
        np.linalg.norm(
            se3.apply(found[0].T_query_support, found[0].p_support) - found[0].p_query, axis=1
        ).max()
        < 0.02
    )


def test_what_no_match_leads_to_is_found_anywhere():
    found = search().locate(query(THERE))
    assert off(found[0])[0] < 0.005 and found[0].generator in ("anywhere", "half_turn", "exact", "upright")


def test_a_hint_that_holds_needs_no_matcher():
    asked = []
    found = search(asked=asked, enough=0.7).locate(query(THERE), Progress(at(0.003, 0.0, 0.0) @ T))
    assert asked == [] and off(found[0])[0] < 0.003


def test_what_is_gone_is_looked_for_elsewhere():
    asked = []
    found = search({"fit": T}, asked=asked).locate(query(THERE), Progress(at(0.0, 0.3, 0.0)))
    assert len(asked) == 1 and off(found[0])[0] < 0.003


def test_two_equal_things_are_two_candidates():
    other = at(0.0, 0.2)
    found = search().locate(query(THERE, other))
    for pose in (THERE, other):
        assert min(off(c, pose)[0] for c in found if c.probability > 0.7) < 0.01


def test_where_it_was_in_vain_is_looked_for_last():
    """Of two equal things the other one comes first, and at once if the arm cannot go to the first."""
    both = query(THERE, at(0.0, 0.2))
    first, *_ = free = search().locate(both)
    T_tried = first.T_query_support @ GRASP
    for luck in (0.0, 0.1):
        found = search().locate(both, Progress(tried=(Tried(T_tried, luck),)))
        again = [se3.near(c.T_query_support @ GRASP, T_tried, 0.02, 0.17) for c in found]
        assert not again[0] and found[0].probability == pytest.approx(free[0].probability, abs=0.1)
        assert luck or not any(c.probability for c, tried in zip(found, again, strict=True) if tried)


def test_what_was_tried_elsewhere_changes_nothing():
    (free, *_), (found, *_) = (
        search().locate(query(THERE), Progress(tried=tried)) for tried in ((), (Tried(HOME, 0.0),))
    )
    assert found.probability == free.probability
    np.testing.assert_array_equal(found.T_query_support, free.T_query_support)


def test_one_failure_does_not_outweigh_what_is_certain():
    """Bad luck is likelier than something that nothing speaks for."""
    first, *_ = search().locate(query(THERE))
    tried = Tried(first.T_query_support @ GRASP, 0.1)
    again, *_ = search().locate(query(THERE), Progress(tried=(tried,)))
    assert off(again)[0] < 0.01 and again.probability < first.probability


def test_of_several_things_the_one_of_the_same_colour_is_likelier():
    boxes = [box(SIZE, RED, THERE, seed=1), box(SIZE, BLUE, at(0.0, 0.2), seed=2)]
    found = search().locate(scene(boxes, HOME))
    assert off(found[0])[0] < 0.005


def test_no_candidate_is_listed_twice_and_the_likeliest_is_first():
    found = search({"fit": T, "firm": T}).locate(query(THERE))
    p = [c.probability for c in found]
    assert p == sorted(p, reverse=True)
    goals = np.stack([c.T_query_support for c in found])
    near = se3.near(goals[:, None], goals[None], 1e-4, 1e-3)
    assert near.sum() == len(found)


def test_every_pool_holds_the_ones_before_it():
    sizes = [len(pool.motions) for pool in search({"fit": T}).pools(query(THERE), BEGINNING)]
    assert sizes == sorted(sizes) or len(sizes) == 3
    pool = list(search({"fit": T}).pools(query(THERE), BEGINNING))[-1]
    evidence = pool.evidence()
    assert evidence.shape == (len(pool.motions), len(EVIDENCE))
    # The hand stands as at the beginning of the demonstration, so repeating its motion says nothing.
    unknown = [name for name, column in zip(EVIDENCE, evidence.T, strict=True) if np.isnan(column).all()]
    assert unknown == ["gripper_away", "gripper_turn"] and np.isnan(evidence).sum() == 2 * len(evidence)
    assert np.isfinite(pool.probabilities()).all()
    assert len(pool.generators) == len(pool.motions)


def test_an_empty_scene_has_no_candidates():
    empty = query()
    bare = type(empty)(empty.observation, empty.fused.select(np.arange(0)))
    assert search().locate(bare) == () and search().locate(empty) == ()


def test_what_is_out_of_focus_is_no_candidate():
    other = at(0.0, 0.2)
    both = query(THERE, other)
    for pose in (THERE, other):
        focus = np.linalg.norm(both.fused.points[:, :2] - pose[:2, 3], axis=1) < 0.1
        found = search({"fit": T}).locate(Scene(both.observation, both.fused, focus))
        assert off(found[0], pose)[0] < 0.005
        assert all(off(candidate, pose)[0] < 0.1 for candidate in found)


def test_if_nothing_is_in_focus_there_is_no_candidate():
    both = query(THERE)
    nothing = Scene(both.observation, both.fused, np.zeros(len(both.fused), dtype=bool))
    assert search({"fit": T}).locate(nothing) == ()


def test_a_generator_that_is_left_out_proposes_nothing():
    found = {c.generator for c in search({"fit": T}).locate(query(THERE))}
    without = {c.generator for c in search({"fit": T}, without=("fit",)).locate(query(THERE))}
    assert "fit" in found and "fit" not in without and without


def test_a_faint_mark_makes_its_turn_stand_out_among_all_turns():
    shown, yaw = marked_can(0.0, HERE), 0.9
    region = Region(shown, np.ones(len(shown)), np.zeros((0, 3)), spread=np.full(len(shown), 0.001))
    step = transitions([scene([shown], HOME), scene([shown], GRASP)], [(GRASP, False)])[0]
    found = StepSearch(PolicyConfig(), step, region, None, Verifier(Exact()), lambda _: Asked({}, NOTHING))
    *_, pool = found.pools(scene([marked_can(yaw, THERE)], HOME), BEGINNING)
    turned = se3.rotation_distance(np.stack(pool.motions) @ HERE, THERE @ at(0, 0, 0, yaw=yaw))
    # A strip looks the same half a turn round.
    away = np.minimum(turned, np.pi - turned)
    stands_out = pool.evidence()[:, EVIDENCE.index("turned_pattern")]
    assert away.min() < 0.1
    assert stands_out[away < 0.1].min() > 0.5 > 0.1 > stands_out[away > 0.2].max()
