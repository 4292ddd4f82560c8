"""Demonstrations of the expert that are recorded once and kept in a folder."""

import json
import re
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

from imop.demos.store import DemonstrationStore
from imop.errors import InvalidInput
from imop.evaluation.trials import DEMONSTRATION_SEED, Trial, demonstration_for, expert_state
from imop.files import replaced
from imop.sim.world import World, scene_spec
from imop.tasks.env import make_task
from imop.tasks.expert import ExpertFailed, record_demonstration
from imop.tasks.layout import NoRoom
from imop.types import Demonstration


class Recordings:
    """What the expert does in scenes of a task; recorded when first asked for.

    Recordings of another state of the simulator's or the tasks' code are not used.

    Args:
        folder: where they are kept, for all tasks and states of the code.
        task: name of the task, whose code counts, too, if it is one's own.
    """

    def __init__(self, folder: Path, task: str):
        path = folder / "-".join(["recordings", *expert_state(task)])
        self._failed = path / "failed"
        try:
            self._store = DemonstrationStore.open(path / "demos.zarr")
        except InvalidInput:
            self._store = DemonstrationStore.create(path / "demos.zarr")
        self._numbers = {}
        for number, file in enumerate(sorted(Path(self._store.path).glob("episode_*/zarr.json"))):
            a = json.loads(file.read_text())["attributes"]
            scene, objects = a["seeds"]["episode"], a["seeds"]["instance"]
            self._numbers[Trial(a["task"], scene, a["variation"], objects)] = number

    def scene(self, trial: Trial) -> Demonstration | None:
        """What the expert does in the trial's scene; None if it fails there."""
        # What was demonstrated does not change the scene.
        trial = replace(trial, shown=None, shown_variation=None)
        if trial in self._numbers:
            return self._store[self._numbers[trial]]
        failure = self._failed / "-".join(re.sub(r"\W", "_", str(v)) for v in asdict(trial).values())
        if failure.exists():
            return None
        try:
            recorded = record_demonstration(
                make_task(trial.task), trial.seed, trial.variation, trial.instance
            )
        except (ExpertFailed, NoRoom) as error:
            with replaced(failure) as temporary:
                temporary.write_text(str(error))
            return None
        return self._kept(recorded)

    def demonstration(self, trial: Trial) -> Demonstration:
        """The demonstration of the trial's task, shown variation and objects, see `demonstration_for`.

        Raises:
            ExpertFailed, NoRoom: as `demonstration_for`.
        """
        shown = trial.demonstrated
        wanted = (shown.task, shown.variation, shown.instance)
        for known, number in self._numbers.items():
            if known.seed >= DEMONSTRATION_SEED and (known.task, known.variation, known.instance) == wanted:
                return self._store[number]
        return self._kept(demonstration_for(trial))

    def _kept(self, recorded: Demonstration) -> Demonstration:
        seeds = recorded.seeds
        trial = Trial(recorded.task, seeds["episode"], recorded.variation, seeds["instance"])
        self._numbers[trial] = self._store.append(recorded)
        return recorded


def objects_world(trial: Trial) -> World:
    """The objects of the trial's task alone, not placed."""
    task, spec = trial.make_task(), scene_spec()
    task.build(spec, trial.variation, np.random.default_rng((trial.instance, trial.variation)))
    world = World(spec)
    task.prepare(world)
    return world
