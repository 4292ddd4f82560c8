from dataclasses import replace

import pytest

from imop.demos.episode import digest_of
from imop.errors import InvalidInput
from imop.evaluation.benchmark import shown_together
from imop.evaluation.methods import make_policy
from imop.evaluation.oracle import OraclePolicy
from imop.evaluation.rollout import rollout
from imop.evaluation.trials import (
    DEMONSTRATION_SEED,
    Trial,
    change_notes,
    demonstration_for,
    demonstrations_for,
    disturbed,
    most_actions,
    suite_trials,
)


def test_scenes_that_would_be_those_of_demonstrations_are_refused_before_any_is_tried():
    last = DEMONSTRATION_SEED - 2
    (trials,) = suite_trials("tabletop", "all", ("lid_off_pot",), 2, last, 0).values()
    assert [trial.seed for trial in trials] == [last, last + 1]
    with pytest.raises(InvalidInput, match="seed"):
        suite_trials("tabletop", "all", ("lid_off_pot",), 3, last, 0)


def test_every_task_gets_the_changes_that_it_has_and_one_without_any_is_left_out():
    names = ("lid_off_pot", "stack_cubes")
    trials = suite_trials("tabletop", "all", names, 1, 0, 0, "d415,object_color")
    assert [trial.change for (trial,) in trials.values()] == ["object_color,d415", "d415"]
    assert change_notes(trials, "d415,object_color")[-1] == "object_color was not changed in stack_cubes."
    assert list(suite_trials("tabletop", "all", names, 1, 0, 0, "object_color")) == ["lid_off_pot"]


def test_a_change_has_one_name_whatever_the_order():
    assert Trial("tabletop/lid_off_pot", 0, change="d415,light") == Trial(
        "tabletop/lid_off_pot", 0, change="light,d415,"
    )
    with pytest.raises(InvalidInput, match="change"):
        Trial("tabletop/lid_off_pot", 0, change="darkness")


def test_a_missing_camera_is_missing_in_demonstration_and_test_and_no_policy_minds():
    trial = Trial("tabletop/lid_off_pot", 3, change="fewer_cameras")
    env, shown = trial.env(), demonstration_for(trial)
    seen = [*(k.observation for k in shown.keyframes), shown.final, env.observation]
    assert {frozenset(observation.views) for observation in seen} == {
        frozenset(("front", "left_shoulder", "wrist"))
    }
    policy = make_policy("registration")
    policy.watch(shown.stripped())
    assert rollout(env, policy, len(shown)).success


def test_other_instances_are_shown_one_and_tried_with_others():
    same, other = (
        suite_trials("tabletop", "all", ("lid_off_pot",), 3, 5, 2, other=wanted)["lid_off_pot"]
        for wanted in (False, True)
    )
    assert [t.instance for t in same] == [2, 2, 2] and [t.seed for t in other] == [5, 6, 7]
    assert len({t.instance for t in other} | {2}) == 4
    assert {t.demonstrated.instance for t in (*same, *other)} == {2}
    assert len({shown_together(t) for t in (*same, *other)}) == 1
    with pytest.raises(InvalidInput, match="rlbench") as error:
        suite_trials("rlbench", "all", ("open_drawer",), 1, 0, 0, other=True)
    assert error.value.field == "instances"


def test_the_oracle_carries_poses_over_to_another_rope():
    trial = Trial("tabletop/straighten_rope", 3, 0, 7, shown=0)
    env = trial.env()
    policy = OraclePolicy(env.world)
    policy.watch(demonstration_for(trial))
    assert rollout(env, policy, env.task.step_limit).success


def test_a_demonstration_may_show_another_variation_and_the_scene_stays():
    trial = Trial("tabletop/press_buttons", 3, 1, 4, shown=2, shown_variation=0)
    shown = demonstration_for(trial)
    assert (shown.variation, shown.seeds["instance"]) == (0, 2)
    assert shown_together(trial) == shown_together(Trial("tabletop/press_buttons", 3, 0, 2))
    plain = Trial("tabletop/press_buttons", 3, 1, 4)
    assert plain.demonstrated == plain
    poses = [t.env().world.pose("button0/body") for t in (trial, plain)]
    assert (poses[0] == poses[1]).all()


def test_tasks_in_which_a_disturbance_cannot_happen_are_left_out():
    trials = suite_trials("tabletop", "all", ("lid_off_pot", "press_buttons"), 2, 0, 0)
    assert list(disturbed(trials, "moved")) == list(trials)
    (lids,) = disturbed(trials, "knocked").values()
    assert [trial.task for trial in lids] == 2 * ["tabletop/lid_off_pot"]
    assert {(trial.disturb, trial.second_try) for trial in lids} == {("knocked", True)}
    for kind, field in (("shut", "disturb"), ("stolen", "disturb")):
        with pytest.raises(InvalidInput) as error:
            disturbed(trials, kind)
        assert error.value.field == field


def test_who_may_try_again_has_more_actions_than_were_shown():
    trial, shown = Trial("tabletop/lid_off_pot", 0), [None] * 3
    task = trial.make_task()
    assert most_actions("replay", shown, trial, task) == 3
    for again in (Trial(trial.task, 0, disturb="moved"), Trial(trial.task, 0, second_try=True)):
        assert most_actions("replay", shown, again, task) == task.step_limit > 3


def test_further_demonstrations_show_instances_that_are_never_tried():
    trial = Trial("tabletop/lid_off_pot", 3, 0, 9, shown=0, demonstrations=3)
    shown = demonstrations_for(trial)
    instances = [demonstration.seeds["instance"] for demonstration in shown]
    assert instances[0] == 0 and len(set(instances)) == 3
    assert min(instances[1:]) > 2 * DEMONSTRATION_SEED
    assert min(demonstration.seeds["episode"] for demonstration in shown) >= DEMONSTRATION_SEED
    assert shown_together(trial) != shown_together(Trial("tabletop/lid_off_pot", 3, 0, 9, shown=0))
    with pytest.raises(InvalidInput, match="demonstrations"):
        Trial("tabletop/lid_off_pot", 3, demonstrations=0)


def test_a_demonstration_that_is_kept_is_recorded_once_and_read_back_as_it_was(tmp_path, monkeypatch):
    trial = Trial("tabletop/lid_off_pot", 3)
    first = demonstration_for(trial, tmp_path)

    def never(*_, **options):
        raise AssertionError("recorded again")

    monkeypatch.setattr("imop.evaluation.trials.record_demonstration", never)
    assert digest_of(demonstration_for(replace(trial, seed=4), tmp_path)) == digest_of(first)
    for other in (replace(trial, instance=2), trial):
        with pytest.raises(AssertionError, match="recorded"):
            demonstration_for(other, None if other is trial else tmp_path)
