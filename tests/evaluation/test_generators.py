import re

import numpy as np
import pytest
from benchmarks.generators import (
    CONFIGURATIONS,
    GENERATORS,
    Options,
    Query,
    Row,
    answers,
    difference,
    groups,
    markdown,
    summary,
)

import imop.policy.proposals
from benchmarks import generators
from imop.errors import InvalidInput, NoConfidentMatch
from imop.evaluation.statistics import wilson
from imop.evaluation.trials import Trial
from imop.geometry import se3
from imop.types import Action, Match

NONE = np.zeros((0, 3))


def rows(right, without="", other=False):
    return [Row(without, "t", 0, 0, other, step, "", hit) for step, hit in enumerate(right)]


def test_every_generator_of_the_table_is_left_out_once():
    table = re.findall(r"^\| (`.*`) \|", imop.policy.proposals.__doc__, re.MULTILINE)
    assert sorted(GENERATORS) == sorted(re.findall(r"`(\w+)`", " ".join(table)))


def test_a_generator_brings_what_is_lost_without_it_less_what_is_won():
    full, less = [True] * 6 + [False] * 4, [True] * 3 + [False] * 6 + [True]
    d = difference(full, less)
    assert (d["lost"], d["won"], d["difference"]) == (3, 1, pytest.approx(0.2))
    low, high = d["interval"]
    assert low < 0 < 0.2 < high


def test_what_a_generator_brings_is_the_less_certain_the_fewer_were_asked():
    few, many = (difference([True, False] * n, [True, False] * n)["interval"] for n in (5, 50))
    assert few == pytest.approx((-wilson(0, 10)[1], wilson(0, 10)[1]))
    assert many == pytest.approx((-wilson(0, 100)[1], wilson(0, 100)[1]))


def test_losses_and_gains_are_mirror_images():
    full, less = [True] * 5 + [False] * 5, [False] * 4 + [True] * 2 + [False] * 4
    (low, high), (back_low, back_high) = (
        difference(a, b)["interval"] for a, b in ((full, less), (less, full))
    )
    assert (low, high) == pytest.approx((-back_high, -back_low))


def test_without_other_things_there_is_nothing_to_compare():
    with pytest.raises(InvalidInput, match="scenes"):
        summary([row for without in CONFIGURATIONS for row in rows([True], without)])


def test_same_and_other_things_are_told_apart_and_compared_step_by_step():
    hit = {"": ([True, True], [True, False]), "hint": ([False, True], [False, False])}
    found = []
    for without in CONFIGURATIONS:
        same, other = hit.get(without, hit[""])
        # In whatever order they come.
        found += [*rows(other, without, other=True), *rows(same, without)][:: -1 if without else 1]
    s = summary(found)
    assert (s[""]["same"]["right"], s[""]["other"]["right"]) == (2, 1)
    assert (s["hint"]["same"]["right"], s["hint"]["other"]["right"]) == (1, 0)
    assert s["hint"]["brings"]["difference"] == pytest.approx(0.5)
    assert s["fit"]["brings"]["lost"] == s["fit"]["brings"]["won"] == 0
    lines = markdown(s).splitlines()
    assert len(lines) == 2 + len(CONFIGURATIONS) and len({line.count("|") for line in lines}) == 1
    assert "| `hint` | 50.0 % " in lines[3] and "+50.0 %" in lines[3] and lines[3].endswith("| 2, 0 |")


def test_trials_of_a_demonstration_show_the_same_and_other_things():
    found = groups(Options(tasks="open_drawer,close_jar", scenes=4))
    for trials in found:
        assert len({(t.task, t.variation, t.demonstrated.instance) for t in trials}) == 1
        same = [t for t in trials if t.instance == t.demonstrated.instance]
        assert len(same) == len(trials) / 2
    assert sum(map(len, found)) == 2 * 2 * 4


@pytest.mark.parametrize("options", [Options(tasks="lid_off_pot"), Options(scenes=1001), Options(scenes=0)])
def test_only_base_tasks_and_early_seeds_are_asked(options):
    with pytest.raises(InvalidInput):
        groups(options)


class Told:
    """Answers with given motions, and remembers what it was told; None is no answer."""

    def __init__(self, motions):
        self.motions, self.told = motions, []

    def locate(self, query, step, demonstration=0, progress=None):
        self.told.append(progress.T_last)
        T = self.motions[step]
        if T is None:
            raise NoConfidentMatch(0.0, 0.0)
        return Action(T, True, match=Match(step, NONE, NONE, NONE, T, "hint", 1.0))


def test_answers_are_compared_with_the_nearest_right_pose_and_passed_on():
    far, near = se3.make(np.eye(3), np.array([0.1, 0, 0])), se3.make(np.eye(3), np.array([0.115, 0, 0]))
    policy = Told([far, None, np.eye(4), near])
    right = [np.stack([np.eye(4), near])] * 4
    query = Query(Trial("tabletop/open_drawer", 3, instance=4, shown=0), [None] * 4, right)
    found = list(answers(policy, "fit", query))
    assert [row.right for row in found] == [True, False, True, True]
    assert [row.generator for row in found] == ["hint", "", "hint", "hint"]
    assert {(row.without, row.scene, row.other) for row in found} == {("fit", 3, True)}
    # The step without an answer leaves what was known before.
    assert policy.told[0] is None
    for told, known in zip(policy.told[1:], (far, far, np.eye(4)), strict=True):
        assert np.array_equal(told, known)


def test_every_configuration_is_shown_the_demonstration_once(monkeypatch):
    made = []

    class Counted(Told):
        def __init__(self, without):
            super().__init__([np.eye(4)])
            self.without, self.watched = without, 0
            made.append(self)

        def watch(self, demonstration):
            self.watched += 1

    class Shown(list):
        def stripped(self):
            return self

    class Kept:
        def __init__(self, *_):
            pass

        def demonstration(self, trial):
            return Shown([0])

    trials = [Trial("tabletop/open_drawer", 0), Trial("tabletop/open_drawer", 0, instance=1, shown=0)]
    monkeypatch.setattr(generators, "load_model", lambda weights: None)
    monkeypatch.setattr(generators, "Recordings", Kept)
    monkeypatch.setattr(generators, "policy_without", lambda without, model: Counted(without))
    queries = [Query(trial, [None], [np.eye(4)[None]]) for trial in trials]
    monkeypatch.setattr(generators, "seen", lambda *_: queries)
    found = generators.task_rows(trials, None, None)
    assert [(policy.without, policy.watched) for policy in made] == [(name, 1) for name in CONFIGURATIONS]
    assert [row.without for row in found if row.other] == list(CONFIGURATIONS)
    assert len(found) == 2 * len(CONFIGURATIONS)
