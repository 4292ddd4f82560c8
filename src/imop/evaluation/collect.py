"""Recording demonstrations by the expert into a store, on many processes or machines.

What an episode contains depends on its task, variation and number alone, and episodes are appended in one
order: neither the number of workers nor being killed and started again changes what is in the store.
"""

import json
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from joblib import Parallel, delayed, effective_n_jobs, parallel_config
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from imop.demos.store import DemonstrationStore
from imop.errors import InvalidInput, MissingExtra
from imop.evaluation.jobs import check_jobs
from imop.evaluation.report import save_json
from imop.tasks.env import make_task
from imop.tasks.expert import ExpertFailed, record_demonstration
from imop.tasks.layout import NoRoom
from imop.types import Demonstration

COLLECTION_SEED = 2_000_000
"""Collected scenes and objects have this seed and above, and are never tested."""
RETRY_STRIDE = 10_000_000
"""Added to the scene's seed after each failed attempt; the objects stay the same."""
ATTEMPTS = 10
_BATCH = 4
"""Episodes per worker of a cluster between two writes to the store."""

Key = tuple[str, int, int, int]
"""Task, variation, seed of the objects and of the scene in the first attempt: what an episode is."""


@dataclass(frozen=True)
class Collected:
    """What a store contains of what was asked for.

    Attributes:
        episodes: task -> how many.
        failed_attempts: task -> how often the expert failed before them.
        given_up: what the expert failed at in every attempt.
        recorded: how many of the episodes this run recorded.
        seconds: wall time of this run.
    """

    episodes: dict[str, int]
    failed_attempts: dict[str, int]
    given_up: tuple[str, ...]
    recorded: int
    seconds: float

    def as_dict(self) -> dict[str, Any]:
        """The layout of the report."""
        return {
            "episodes": self.episodes,
            "failed_attempts": self.failed_attempts,
            "given_up": list(self.given_up),
            "this_run": {"recorded": self.recorded, "seconds": round(self.seconds, 1)},
        }


def collect(
    out: Path,
    tasks: list[str],
    episodes: int,
    seed: int,
    jobs: int,
    console: Console,
    cluster: str | None = None,
    scenes: int = 1,
    in_turn: bool = False,
) -> Collected:
    """Record `episodes` demonstrations of every variation of every task, but for those in the store already.

    Every episode has its own scene. Writes a report beside the store, NAME.json for NAME.zarr.

    Args:
        out: folder of the store; made if it does not exist.
        tasks: full names.
        episodes: per task and variation.
        seed: number of the first episode; other numbers give other objects and scenes.
        jobs: parallel processes; ignored with a cluster, which is used whole.
        console: where progress is shown.
        cluster: address of a Ray cluster on which imop is installed, or None for this machine.
        scenes: how many episodes in a row have the same objects.
        in_turn: `episodes` counts per task, and the sets of objects have its variations in turn.

    Raises:
        InvalidInput: for an unknown task, no episodes, no scenes, no processes or a negative seed.
        MissingExtra: if there is a cluster but Ray is not installed.
    """
    if episodes < 1 or not 0 <= seed <= RETRY_STRIDE - COLLECTION_SEED - episodes:
        problem = f"{episodes} episodes from number {seed}"
        raise InvalidInput("episodes, seed", problem, "at least one episode, numbers from 0 to 8 million")
    if scenes < 1:
        raise InvalidInput("scenes", f"{scenes}", "at least one scene for the same objects")
    check_jobs(jobs)
    wanted = [key for task in tasks for key in _keys(task, episodes, COLLECTION_SEED + seed, scenes, in_turn)]
    started = time.monotonic()
    store = DemonstrationStore.open(out) if _is_store(out) else DemonstrationStore.create(out)
    present = recorded_seeds(store)
    missing = [key for key in wanted if key not in present]
    given_up = []
    with _backend(cluster):
        results = _results(missing, jobs, cluster is not None)
        for key, demonstration in zip(missing, _shown(results, len(missing), console), strict=True):
            if demonstration is None:
                given_up.append(f"{key[0]}, variation {key[1]}, objects {key[2]}, scene {key[3]}")
            else:
                store.append(demonstration)
    present = recorded_seeds(store)
    found = [key for key in wanted if key in present]
    attempts = Counter({task: 0 for task in tasks})
    for key in found:
        attempts[key[0]] += present[key] // RETRY_STRIDE
    counts = Counter(key[0] for key in found)
    collected = Collected(
        dict(counts),
        dict(attempts),
        tuple(given_up),
        len(missing) - len(given_up),
        time.monotonic() - started,
    )
    save_json(collected.as_dict(), out.with_suffix(".json"))
    return collected


def _keys(task: str, episodes: int, first: int, scenes: int, in_turn: bool) -> list[Key]:
    count = make_task(task).variations
    numbers = [(first + i // scenes, first + i) for i in range(episodes)]
    if in_turn:
        return [(task, (instance - first) % count, instance, scene) for instance, scene in numbers]
    return [(task, variation, *number) for variation in range(count) for number in numbers]


def recorded_seeds(store: DemonstrationStore) -> dict[Key, int]:
    """What every simulated episode of a local store is -> seed of the scene of the successful attempt."""
    seeds = {}
    for file in sorted(Path(store.path).glob("episode_*/zarr.json")):
        a = json.loads(file.read_text())["attributes"]
        if {"instance", "episode"} <= a["seeds"].keys():
            scene = a["seeds"]["episode"]
            seeds[a["task"], a["variation"], a["seeds"]["instance"], scene % RETRY_STRIDE] = scene
    return seeds


def record(key: Key) -> Demonstration | None:
    """One episode; None if the expert fails in `ATTEMPTS` scenes with these objects."""
    task, variation, instance, scene = key
    for attempt in range(ATTEMPTS):
        try:
            return record_demonstration(make_task(task), scene + attempt * RETRY_STRIDE, variation, instance)
        except (ExpertFailed, NoRoom):
            continue
    return None


def _is_store(out: Path) -> bool:
    return out.is_dir() and any(out.iterdir())


def _shown(
    results: Iterator[Demonstration | None], total: int, console: Console
) -> Iterator[Demonstration | None]:
    """The same results, with progress."""
    columns = (
        TextColumn("recording"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console, transient=True) as progress:
        bar = progress.add_task("", total=total, rate="")
        started = time.monotonic()
        for done, result in enumerate(results, start=1):
            yield result
            rate = 60 * done / (time.monotonic() - started)
            progress.update(bar, advance=1, rate=f"{rate:.0f} a minute")


def _results(keys: list[Key], jobs: int, cluster: bool) -> Iterator[Demonstration | None]:
    if not cluster:
        yield from Parallel(n_jobs=jobs, return_as="generator")(delayed(record)(key) for key in keys)
        return
    # Joblib's Ray backend returns only finished lists; what is lost at a kill is one batch.
    size = _BATCH * effective_n_jobs(-1)
    for start in range(0, len(keys), size):
        yield from Parallel(n_jobs=-1)(delayed(record)(key) for key in keys[start : start + size])


@contextmanager
def _backend(cluster: str | None) -> Iterator[None]:
    """Where joblib works: here, or on the Ray cluster with that address."""
    if cluster is None:
        yield
        return
    try:
        ray: Any = import_module("ray")
        ray_joblib: Any = import_module("ray.util.joblib")
    except ImportError:
        raise MissingExtra("ray", "cluster") from None
    ray.init(address=cluster, ignore_reinit_error=True, log_to_driver=False)
    ray_joblib.register_ray()
    with parallel_config(backend="ray"):
        yield
