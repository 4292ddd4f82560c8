"""Recording demonstrations by the expert into a store."""

from pathlib import Path

from joblib import delayed
from rich.console import Console

from imop.demos.store import DemonstrationStore
from imop.evaluation.benchmark import parallel
from imop.evaluation.trials import SUITES, Trial, suite_trials
from imop.tasks.env import make_task
from imop.tasks.expert import ExpertFailed, record_demonstration
from imop.tasks.layout import NoRoom
from imop.types import Demonstration

_RETRY_STRIDE = 100_000
_ATTEMPTS = 10


def collect_suite(
    out: Path, suite: str, tasks: tuple[str, ...], episodes: int, seed: int, jobs: int, console: Console
) -> tuple[int, int]:
    """Append `episodes` demonstrations of every variation of every task to the store at `out`.

    Every episode has its own instance of the objects.

    Returns:
        How many were recorded, and how many attempts failed and were repeated with another seed.

    Raises:
        InvalidInput: for an unknown suite or task.
        ExpertFailed: if the expert fails again and again at one episode.
    """
    wanted = []
    for trials in suite_trials(suite, tasks, 1, seed, 0).values():
        variations = SUITES[suite][trials[0].task].variations
        wanted += [
            Trial(trials[0].task, seed + i, variation, seed + i)
            for variation in range(variations)
            for i in range(episodes)
        ]
    store = DemonstrationStore.create(out) if not out.exists() else DemonstrationStore.open(out)
    failures = 0
    for demonstration, failed in parallel([delayed(_record)(t) for t in wanted], jobs, console, "episodes"):
        store.append(demonstration)
        failures += failed
    return len(wanted), failures


def _record(trial: Trial) -> tuple[Demonstration, int]:
    task = make_task(trial.task)
    for attempt in range(_ATTEMPTS):
        seed = trial.seed + attempt * _RETRY_STRIDE
        try:
            return record_demonstration(task, seed, trial.variation, trial.instance), attempt
        except (ExpertFailed, NoRoom) as error:
            failure = error
    raise failure
