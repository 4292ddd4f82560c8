"""What open-loop benchmarks ask for: a demonstration, and recorded scenes of its task and variation."""

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from imop.demos.rlbench import episodes, read_episode
from imop.errors import InvalidInput
from imop.evaluation.appearance import Appearance
from imop.evaluation.config import Instances
from imop.evaluation.open_loop import Case
from imop.evaluation.recordings import Recordings, objects_world
from imop.evaluation.trials import Trial, suite_trials
from imop.files import user_cache
from imop.tasks.expert import ExpertFailed
from imop.tasks.layout import NoRoom


@dataclass
class CaseOptions:
    """Which demonstrations and scenes a benchmark asks for.

    Attributes:
        suite: of the simulated tasks.
        split: which of its tasks.
        tasks: comma-separated names within the suite; all of the split by default.
        demos: a folder in RLBench's layout instead of a suite: an episode, a task, or several tasks.
        scenes: per task, with its variations in turn.
        seed: of the first scene.
        instance: seed of the demonstrated objects.
        instances: whether the scenes of a suite show the same objects, or in each scene others of their kind.
        cache: where recorded scenes are kept.
    """

    suite: str = "tabletop"
    split: str = "all"
    tasks: str = ""
    demos: Path | None = None
    scenes: int = 3
    seed: int = 0
    instance: int = 0
    instances: Instances = "same"
    cache: Path = field(default_factory=user_cache)

    def cases(self) -> list[Callable[[], Case]]:
        """One case for each demonstration, made when it is called; see `simulated_cases`.

        Raises:
            ImopError: for a suite, split or task that there is not, or recordings that cannot be used.
        """
        if self.demos is None:
            tasks = tuple(filter(None, self.tasks.split(",")))
            which = self.suite, self.split, tasks, self.scenes, self.seed, self.instance
            return simulated_cases(suite_trials(*which, other=self.instances == "other"), self.cache)
        if self.instances == "other":
            raise InvalidInput("instances", "other in recordings", "same, or a suite instead of demos")
        cases = recorded_cases(self.demos)
        if not cases:
            raise InvalidInput("demos", f"{self.demos}", "at least two episodes of one task and variation")
        return cases


def made(make_case: Callable[[], Case]) -> Case | None:
    """The case, or None, with a line on standard error, if there is no demonstration for it."""
    try:
        return make_case()
    except (ExpertFailed, NoRoom) as error:
        print(f"left out: {error}", file=sys.stderr)
        return None


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
    recordings = Recordings(cache, trials[0].task)
    shown = recordings.demonstration(trials[0])
    scenes = {str(trial.seed): recordings.scene(trial) for trial in trials}
    queries = {name: scene for name, scene in scenes.items() if scene is not None}
    appearance = Appearance(objects_world(trials[0].demonstrated))
    others = {str(t.seed): Appearance(objects_world(t)) for t in trials if t.other_things}
    return Case(task, str(shown.seeds["episode"]), shown, queries, appearance, others)
