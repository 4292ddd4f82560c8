import pytest
from joblib.externals.loky import get_reusable_executor
from rich.console import Console

from imop.errors import InvalidInput, MissingExtra
from imop.evaluation import benchmark
from imop.evaluation.benchmark import evaluate_suite, tried
from imop.evaluation.config import EvaluationConfig
from imop.evaluation.episodes import read_episodes
from imop.evaluation.trials import Trial, demonstrations_for, suite_trials

MODULE = """
from imop.errors import InvalidInput, MissingExtra

class Policy:
    def watch(self, demonstration):
        pass

    def reset(self):
        pass

class Lacking(Policy):
    def act(self, observation):
        raise MissingExtra("open3d", "baselines")

class Lost(Policy):
    def act(self, observation):
        raise InvalidInput("observation", "nothing to see", "something")
"""


@pytest.fixture
def evaluated(tmp_path, monkeypatch):
    """Tries methods of a module in a folder in which the workers begin."""
    (tmp_path / "no_help.py").write_text(MODULE)
    monkeypatch.chdir(tmp_path)
    get_reusable_executor().shutdown()

    def evaluate(method, jobs=2):
        config = EvaluationConfig(
            tasks=("lid_off_pot",), methods=f"no_help:{method}", episodes=1, jobs=jobs, out=tmp_path
        )
        results = evaluate_suite(config, Console(quiet=True))
        return results, list(read_episodes(tmp_path / "episodes.jsonl"))

    yield evaluate
    get_reusable_executor().shutdown()


def test_an_extra_that_a_worker_misses_ends_the_run_and_is_no_failed_episode(evaluated, tmp_path):
    with pytest.raises(MissingExtra, match=r"imop\[baselines\]"):
        evaluated("Lacking")
    assert list(read_episodes(tmp_path / "episodes.jsonl")) == []


def test_what_a_policy_cannot_handle_it_has_failed_at(evaluated):
    results, (episode,) = evaluated("Lost")
    assert episode.success is False and episode.error and "nothing to see" in episode.reason
    assert results.average("no_help:Lost") == 0


@pytest.mark.parametrize("jobs", [0, -2])
def test_less_than_one_process_is_refused(evaluated, jobs):
    with pytest.raises(InvalidInput, match="jobs"):
        evaluated("Lost", jobs)


@pytest.mark.parametrize("method", ["replay", "oracle"])
def test_nobody_points_out_things_to_what_does_not_look(method, tmp_path):
    with pytest.raises(InvalidInput) as error:
        tried(
            [Trial("tabletop/lid_off_pot", 0)], [method], 1, Console(quiet=True), tmp_path / "log", focus=True
        )
    assert error.value.field == "focus" and not (tmp_path / "log").exists()


def test_what_one_policy_does_does_not_depend_on_its_episodes_before():
    """Policies are kept for all scenes of a demonstration; a new one does the same in the last of them."""
    trials = suite_trials("tabletop", "all", ("lid_off_pot",), 2, 0, 0)["lid_off_pot"]
    key = benchmark.shown_together(trials[0])
    shown = benchmark.Shown(key, tuple(demonstrations_for(trials[0])))
    kept = [benchmark.attempt(trial, shown, "learned", "state") for trial in trials]
    benchmark._watched.cache_clear()
    assert benchmark.attempt(trials[1], shown, "learned", "state") == kept[1]
    assert benchmark._watched.cache_info().misses == 1


def test_scenes_of_the_same_demonstration_are_tried_together_and_none_is_lost():
    """One demonstration for all variations of a pot, one for each of the drawers; more than fit at once."""
    pots, drawers = (
        suite_trials("tabletop", "all", (name,), 30, 0, 0)[name] for name in ("lid_off_pot", "open_drawer")
    )
    wanted = [(trial, method, "", None) for trial in (*pots, *drawers) for method in ("b", "a")]
    together = benchmark._together(wanted)
    assert sorted(map(str, wanted)) == sorted(str(one) for group in together for one in group)
    for group in together:
        assert len({benchmark.shown_together(one[0]) for one in group}) == 1
        assert len(group) <= benchmark._AT_ONCE
        # Who has watched goes on: methods do not alternate.
        assert [one[1] for one in group] == sorted(one[1] for one in group)
