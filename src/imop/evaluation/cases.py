"""What open-loop benchmarks ask for: a demonstration, and recorded scenes of its task and variation."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

from imop.demos.rlbench import episodes, read_episode
from imop.evaluation.appearance import Appearance
from imop.evaluation.open_loop import Case
from imop.evaluation.recordings import Recordings, objects_world
from imop.evaluation.trials import Trial


def recorded_cases(demos: Path) -> list[Callable[[], Case]]:
    """One case for each episode in RLBench's layout that has others of its task and variation.

    Raises:
        ImopError: if an episode cannot be read.
    """
    read = {path: read_episode(path) for path in episodes(demos)}
    kind = {path: (episode.task, episode.variation) for path, episode in read.items()}
    found: list[Callable[[], Case]] = []
    for path, episode in read.items():
        others = {p.name: read[p] for p in read if p != path and kind[p] == kind[path]}
        if others:
            found.append(partial(Case, episode.task, path.name, episode, others))
    return found


def simulated_cases(trials: Mapping[str, Sequence[Trial]], cache: Path) -> list[Callable[[], Case]]:
    """One case for each task and variation of trials (see `suite_trials`), recorded when it is made.

    Making one raises `ExpertFailed` or `NoRoom` if there is no demonstration.

    Args:
        trials: by task.
        cache: folder where recorded scenes are kept.
    """
    groups: dict[tuple[str, int], list[Trial]] = {}
    for task, of_task in trials.items():
        for trial in of_task:
            groups.setdefault((task, trial.variation), []).append(trial)
    return [partial(_simulated_case, task, group, cache) for (task, _), group in groups.items()]


def _simulated_case(task: str, trials: list[Trial], cache: Path) -> Case:
    """The demonstration and the scenes of one task and variation, but for scenes that the expert fails in."""
    recordings = Recordings(cache)
    shown = recordings.demonstration(trials[0])
    scenes = {str(trial.seed): recordings.scene(trial) for trial in trials}
    queries = {name: scene for name, scene in scenes.items() if scene is not None}
    appearance = Appearance(objects_world(trials[0]))
    return Case(task, str(shown.seeds["episode"]), shown, queries, appearance)
