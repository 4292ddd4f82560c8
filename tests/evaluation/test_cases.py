from dataclasses import replace

import numpy as np
import pytest

from imop.errors import ImopError, InvalidInput
from imop.evaluation.cases import CaseOptions, made, recorded_cases, simulated_cases
from imop.evaluation.open_loop import ask
from imop.evaluation.oracle import OraclePolicy
from imop.evaluation.trials import Trial, suite_trials
from imop.geometry.accuracy import FINE
from imop.tasks.expert import ExpertFailed


def test_one_case_for_each_task_and_variation(tmp_path):
    seeds_and_variations = ((0, 0), (1, 1), (2, 0))
    trials = [Trial("tabletop/press_buttons", seed, kind, 0) for seed, kind in seeds_and_variations]
    assert len(simulated_cases({"press_buttons": trials}, tmp_path)) == 2
    everything = suite_trials("tabletop", "novel", (), 1, 0, 0)
    assert len(simulated_cases(everything, tmp_path)) == len(everything)


def test_a_folder_without_episodes_has_no_cases(tmp_path):
    with pytest.raises(InvalidInput):
        recorded_cases(tmp_path)


def test_options_say_which_cases(tmp_path):
    few = CaseOptions(tasks="press_buttons,stack_cubes", scenes=2, cache=tmp_path)
    assert len(few.cases()) == sum(len({t.variation for t in trials}) for trials in asked(few).values())
    with pytest.raises(ImopError, match="task"):
        CaseOptions(tasks="fly", cache=tmp_path).cases()
    with pytest.raises(InvalidInput):
        CaseOptions(demos=tmp_path).cases()


def test_recordings_have_no_other_instances(tmp_path):
    with pytest.raises(InvalidInput) as error:
        CaseOptions(demos=tmp_path, instances="other").cases()
    assert error.value.field == "instances"


def test_queries_of_other_instances_have_the_appearance_of_their_own_objects(tmp_path):
    options = CaseOptions(tasks="close_laptop", scenes=2, instances="other", cache=tmp_path)
    (make_case,) = options.cases()
    case = make_case()
    assert case.demonstration.seeds["instance"] == 0
    assert {name: query.seeds["instance"] for name, query in case.queries.items()} == {"0": 1, "1": 2}
    assert set(case.others) == set(case.queries)
    sizes = [look.model.geom_size for look in map(world_of, (case.appearance, *case.others.values()))]
    assert not any(np.array_equal(sizes[0], other) for other in sizes[1:])
    rows = list(ask("oracle", OraclePolicy, case))
    assert rows and all(row.within(FINE) for row in rows)
    # The recorded poses are others: the expert knows the new screens.
    assert max(row.plain_position for row in rows) > FINE[0]
    same = replace(case, others={})
    assert not all(row.within(FINE) for row in ask("oracle", OraclePolicy, same))


def world_of(appearance):
    return appearance._world


def asked(options):
    tasks = tuple(options.tasks.split(","))
    return suite_trials(options.suite, options.split, tasks, options.scenes, options.seed, options.instance)


def test_a_case_without_a_demonstration_is_left_out_and_said(capsys):
    def fails():
        raise ExpertFailed("stack_cubes", 2, "no grasp")

    assert made(fails) is None
    assert "left out: stack_cubes: the expert failed at step 2" in capsys.readouterr().err
    whole = object()
    assert made(lambda: whole) is whole
