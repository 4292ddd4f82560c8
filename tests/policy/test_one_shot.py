"""The whole policy on simulated scenes: it transfers, reads nothing privileged, and says what is wrong."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from imop.errors import CorruptData, ImopError, InvalidInput, NoConfidentMatch
from imop.geometry import se3
from imop.geometry.focus import Focus
from imop.geometry.neighbours import nearest
from imop.geometry.view_alignment import corrected, find_errors
from imop.networks.model import Model, ModelConfig, save_model
from imop.policy.decision import CLEARANCE, above_ground
from imop.policy.one_shot import OneShotPolicy
from imop.policy.recovery import ARRIVED
from imop.policy.registration import RegistrationMatcher
from imop.policy.router import AdvancingRouter, LearnedRouter
from tests.policy.scenes import TABLE, above, scene, table, transitions


def with_depth(observation, depth):
    views = {n: replace(v, depth=np.full_like(v.depth, depth)) for n, v in observation.views.items()}
    return replace(observation, views=views)


def same(a, b):
    return (
        np.array_equal(a.T_world_gripper, b.T_world_gripper)
        and a.confidence == b.confidence
        and np.array_equal(a.match.p_query, b.match.p_query)
    )


def test_poses_are_transferred_to_another_scene(policy, shown, wanted):
    for number, (keyframe, demonstrated) in enumerate(zip(wanted.keyframes, shown.keyframes, strict=True)):
        action = policy.act(keyframe.observation.stripped())
        expert = keyframe.action.T_world_gripper
        # The scenes differ, and the pot's turn may be seen otherwise: its lid is round.
        assert se3.translation_distance(demonstrated.action.T_world_gripper, expert) > 0.05
        assert se3.translation_distance(action.T_world_gripper, expert) < 0.01
        assert action.T_world_gripper[:3, 2] @ expert[:3, 2] > np.cos(np.radians(5))
        assert action.gripper_open == demonstrated.action.gripper_open
        assert action.allow_collisions == demonstrated.action.allow_collisions
        assert action.confidence > 0.5
        assert action.match.step == number and len(action.match.p_query) > 50


def test_exact_cameras_are_left_alone(shown, wanted):
    for demonstration in (shown, wanted):
        seen = [*(k.observation for k in demonstration.keyframes), demonstration.final]
        for name, T in find_errors(seen).items():
            assert np.array_equal(T, np.eye(4)), name
        for observation in seen:
            for name, T in find_errors([observation]).items():
                # A single state may seem to disagree, where little but slanted faces is seen twice.
                assert se3.translation_distance(T, np.eye(4)) < 1e-3, name
                assert se3.rotation_distance(T, np.eye(4)) < np.radians(0.1), name


def test_cameras_with_wrong_poses_are_corrected_alike_in_demonstration_and_test(perception, shown, wanted):
    rng = np.random.default_rng(0)
    wrong = {
        name: se3.make(se3.euler(*rng.normal(0, np.radians(0.5), 3)), rng.normal(0, 0.003, 3))
        for name in shown.final.views
    }
    steps = [replace(k, observation=corrected(k.observation, wrong)) for k in shown.keyframes]
    policy = OneShotPolicy(RegistrationMatcher.from_pretrained(), perception)
    policy.watch(replace(shown, keyframes=tuple(steps), final=corrected(shown.final, wrong)).stripped())
    action = policy.act(corrected(wanted.keyframes[0].observation, wrong).stripped())
    expert = wanted.keyframes[0].action.T_world_gripper
    assert se3.translation_distance(action.T_world_gripper, expert) < 0.01


def test_a_decision_may_be_asked_for_again_and_counts_when_it_is_taken(policy, wanted):
    first, second = (keyframe.observation for keyframe in wanted.keyframes[:2])
    decision = policy.decide(first)
    assert same(decision.action, policy.decide(first).action) and decision.option.step == 0
    policy.take(decision)
    assert policy.decide(second).option.step == 1
    policy.reset()
    assert same(policy.act(first), decision.action)


def test_another_candidate_can_be_taken_instead_and_the_episode_goes_on_from_it(policy, shown, wanted):
    decision = policy.decide(wanted.keyframes[0].observation)
    probabilities = [candidate.probability for candidate in decision.candidates]
    assert len(probabilities) > 1 and probabilities[0] == decision.action.confidence
    other = policy.instead(decision, 1)
    T = decision.candidates[1].T_query_support
    assert other.action.confidence == probabilities[1]
    assert se3.near(
        other.action.T_world_gripper, T @ shown.keyframes[0].action.T_world_gripper, CLEARANCE, 1e-6
    )
    for number in (-1, len(probabilities)):
        with pytest.raises(InvalidInput, match="number"):
            policy.instead(decision, number)
    policy.take(other)
    following = policy.decide(wanted.keyframes[1].observation)
    assert following.option.step == 1
    policy.take(following)


def test_what_was_shown_can_be_looked_at(policy, shown):
    step, prepared = policy.steps()[1]
    assert len(policy.steps()) == len(shown)
    assert np.array_equal(step.action.T_world_gripper, shown.keyframes[1].action.T_world_gripper)
    assert nearest(prepared.region, step.before.fused.points)[0].max() < 1e-9
    with pytest.raises(InvalidInput, match="demonstration"):
        policy.steps(1)


def test_matched_points_lie_in_the_scene_and_move_rigidly(policy, shown, wanted):
    action = policy.act(wanted.keyframes[0].observation)
    T = action.T_world_gripper @ se3.invert(shown.keyframes[0].action.T_world_gripper)
    error = se3.apply(T, action.match.p_support) - action.match.p_query
    assert np.linalg.norm(error, axis=1).max() < 0.03


def test_privileged_information_changes_nothing(perception, policy, shown, wanted):
    informed = OneShotPolicy(RegistrationMatcher.from_pretrained(), perception)
    informed.watch(replace(shown, task="another/name", instructions=("something else",), variation=7))
    for keyframe in wanted.keyframes[:2]:
        seen = keyframe.observation
        views = {n: replace(v, instance_ids=v.instance_ids[::-1]) for n, v in seen.views.items()}
        scrambled = replace(seen, views=views, instance_names={1: "nonsense"}, joint_velocities=np.ones(7))
        assert same(informed.act(scrambled), policy.act(seen.stripped()))


def test_same_input_same_action(policy, wanted):
    first = policy.act(wanted.keyframes[0].observation)
    policy.reset()
    assert same(first, policy.act(wanted.keyframes[0].observation))


def test_what_the_arm_cannot_reach_gives_way_to_what_is_about_as_right(perception, shown, wanted):
    asked = []

    def not_the_first(T_world_gripper):
        asked.append(T_world_gripper)
        return len(asked) > 1

    observation = wanted.keyframes[0].observation
    free, bound = (
        OneShotPolicy(RegistrationMatcher.from_pretrained(), perception, feasible=f)
        for f in (None, not_the_first)
    )
    for policy in (free, bound):
        policy.watch(shown)
    first, second = free.act(observation), bound.act(observation)
    np.testing.assert_allclose(asked[0], first.T_world_gripper)
    # What was asked about last can be reached, and is taken: another turn of the lid, or another candidate.
    np.testing.assert_allclose(asked[-1], second.T_world_gripper)
    assert len(asked) > 1 and second.reachable and second.confidence <= first.confidence
    assert not np.allclose(first.T_world_gripper, second.T_world_gripper)


def test_if_nothing_can_be_reached_the_best_is_given_and_that_is_said(perception, policy, shown, wanted):
    observation = wanted.keyframes[0].observation
    bound = OneShotPolicy(RegistrationMatcher.from_pretrained(), perception, feasible=lambda T: False)
    bound.watch(shown)
    policy.reset()
    free, stuck = policy.act(observation), bound.act(observation)
    assert stuck.reachable is False and free.reachable is None
    assert se3.translation_distance(stuck.T_world_gripper, free.T_world_gripper) < 0.02


def test_what_could_not_be_carried_out_is_tried_elsewhere(policy, wanted, monkeypatch):
    monkeypatch.setattr(policy, "recovers", True)
    first, second = wanted.keyframes[0].observation, wanted.keyframes[1].observation
    begun = policy.act(first)
    again = policy.act(first)
    assert again.match.step == 0
    assert not se3.near(again.T_world_gripper, begun.T_world_gripper, *ARRIVED)
    arrived = replace(second, T_world_gripper=again.T_world_gripper)
    assert policy.act(arrived).match.step == 1


def test_the_same_demonstration_again_changes_nothing(perception, policy, shown, wanted):
    twice = OneShotPolicy(RegistrationMatcher.from_pretrained(), perception)
    for _ in range(2):
        twice.watch(shown.stripped())
    for keyframe in wanted.keyframes:
        assert same(policy.act(keyframe.observation), twice.act(keyframe.observation))


def test_of_several_demonstrations_the_one_that_is_found_is_followed(perception, shown, wanted):
    """Nothing is left of the other one but its robot."""
    policy = OneShotPolicy(RegistrationMatcher.from_pretrained(), perception)
    bare = [replace(k, observation=_without_things(k.observation)) for k in shown.keyframes]
    policy.watch(replace(shown, keyframes=tuple(bare), final=_without_things(shown.final)).stripped())
    policy.watch(shown.stripped())
    alone = OneShotPolicy(RegistrationMatcher.from_pretrained(), perception)
    alone.watch(shown.stripped())
    for keyframe in wanted.keyframes:
        assert same(policy.act(keyframe.observation), alone.act(keyframe.observation))


def test_the_action_says_who_proposed_it_and_how_it_moved_the_demonstrated_pose(policy, shown, wanted):
    action = policy.act(wanted.keyframes[0].observation)
    demonstrated = shown.keyframes[0].action.T_world_gripper
    np.testing.assert_allclose(action.match.T_query_support @ demonstrated, action.T_world_gripper, atol=1e-9)
    assert action.match.generator and action.match.probability == action.confidence


def test_locating_a_step_changes_nothing_and_is_what_act_does(policy, wanted):
    scene = policy.see(wanted.keyframes[0].observation)
    told = [policy.locate(scene, step) for step in (0, 1, 0)]
    assert same(told[0], told[2]) and same(told[0], policy.act(wanted.keyframes[0].observation))
    assert told[1].match.step == 1


def test_what_is_hidden_now_is_where_it_was_seen_before(policy, wanted):
    first, later = wanted.keyframes[0].observation, wanted.keyframes[1].observation
    earlier = policy.see(first)
    tip = later.T_world_gripper[:3, 3]
    far = np.linalg.norm(earlier.fused.points - tip, axis=1) > 0.25
    lost = earlier.fused.points[far & ~earlier.ground.bare]
    blind = with_depth(later, np.nan)
    one = next(iter(later.views))
    blind = replace(blind, views={**blind.views, one: _lower_quarter(later.views[one])})
    alone, remembered = policy.see(blind), policy.see(blind, earlier=earlier)
    near = [(nearest(lost, scene.fused.points)[0] < 0.012).mean() for scene in (alone, remembered)]
    assert near[1] > 0.95 and near[1] > near[0] + 0.2


def _lower_quarter(view):
    depth = view.depth.copy()
    depth[: 3 * len(depth) // 4] = np.nan
    return replace(view, depth=depth)


def test_what_is_out_of_focus_is_not_acted_on(policy, wanted):
    observation = wanted.keyframes[0].observation
    right = policy.act(observation).T_world_gripper[:3, 3]
    policy.reset()
    around = Focus(box=np.stack([right - 0.15, right + 0.15]))
    there = policy.act(observation, around).T_world_gripper[:3, 3]
    assert np.linalg.norm(there - right) < 0.02
    policy.reset()
    elsewhere = Focus(points=policy.see(observation).fused.points[:1] + 100.0)
    with pytest.raises(NoConfidentMatch):
        policy.act(observation, elsewhere)


def test_an_empty_table_is_no_confident_match(perception, shown, wanted):
    strict = OneShotPolicy(RegistrationMatcher.from_pretrained(), perception, min_confidence=0.5)
    strict.watch(shown)
    seen = wanted.keyframes[0].observation
    with pytest.raises(NoConfidentMatch) as error:
        strict.act(_without_things(seen))
    assert error.value.confidence < 0.5
    # The step was not taken: the same policy finds it when the pot is back.
    assert strict.act(seen).match.step == 0


def _without_things(seen):
    views = {
        name: replace(view, depth=np.where(np.isin(view.instance_ids, _things(seen)), 0, view.depth))
        for name, view in seen.views.items()
    }
    return replace(seen, views=views)


def _things(observation):
    names = observation.instance_names
    return [i for i, name in names.items() if not any(k in name for k in ("robot", "table", "floor", "wall"))]


def test_nothing_watched(perception, wanted):
    with pytest.raises(InvalidInput) as error:
        OneShotPolicy(RegistrationMatcher.from_pretrained(), perception).act(wanted.keyframes[0].observation)
    assert error.value.field == "demonstration"


@pytest.mark.parametrize("depth", [np.nan, 0.0, np.inf])
def test_no_depth(policy, wanted, depth):
    with pytest.raises(InvalidInput) as error:
        policy.act(with_depth(wanted.keyframes[0].observation, depth))
    assert error.value.field == "depth"


def test_nothing_within_reach(policy, wanted):
    with pytest.raises(InvalidInput) as error:
        policy.act(with_depth(wanted.keyframes[0].observation, 50.0))
    assert error.value.field == "views"


def test_missing_camera(policy, wanted):
    seen = wanted.keyframes[0].observation
    views = {name: view for name, view in seen.views.items() if name != "wrist"}
    with pytest.raises(ImopError, match="wrist"):
        policy.act(replace(seen, views=views))


def test_missing_joints(policy, wanted):
    with pytest.raises(InvalidInput) as error:
        policy.act(replace(wanted.keyframes[0].observation, joint_positions=None))
    assert error.value.field == "joint_positions"


def test_a_failed_call_does_not_use_up_a_step(policy, wanted):
    with pytest.raises(InvalidInput):
        policy.act(with_depth(wanted.keyframes[0].observation, np.nan))
    assert policy.act(wanted.keyframes[0].observation).match.step == 0


def test_routing_needs_a_trained_network(tmp_path):
    torch.manual_seed(0)
    model = Model(ModelConfig())
    save_model(model, tmp_path, {})
    with pytest.raises(CorruptData, match="routing"):
        OneShotPolicy.from_pretrained(tmp_path, routed=True)
    assert isinstance(OneShotPolicy.from_pretrained(tmp_path).router, AdvancingRouter)
    model.routing.standardized.batches += 1
    save_model(model, tmp_path, {})
    for routed, kind in ((None, LearnedRouter), (True, LearnedRouter), (False, AdvancingRouter)):
        assert isinstance(OneShotPolicy.from_pretrained(tmp_path, routed=routed).router, kind)


@pytest.mark.parametrize(
    ("shown", "found", "kept"),
    [
        (0.01, 0.0, CLEARANCE),
        (0.01, -0.01, CLEARANCE),
        (0.002, -0.001, 0.002),
        (0.01, 0.02, 0.02),
        (0.002, 0.002, 0.002),
        # Into a hole, and something else altogether.
        (-0.02, -0.025, -0.025),
        (0.01, -0.1, -0.1),
    ],
)
def test_a_pose_is_not_lower_above_the_ground_than_it_may_be(shown, found, kept):
    ground = scene([table()], above(0.1, 0.0, TABLE + 0.3))
    action = above(0.1, 0.0, TABLE + shown), True
    step = transitions([ground, ground], [action])[0]
    lifted = above_ground(above(0.2, 0.1, TABLE + found), ground, step)
    np.testing.assert_allclose(lifted, above(0.2, 0.1, TABLE + kept), atol=1e-4)
