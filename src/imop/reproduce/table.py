"""What a table measures: rows of methods, on sections of tasks, and the published rows beside."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from imop.evaluation.config import Instances
from imop.evaluation.trials import Trial, disturbed, suite_trials
from imop.reproduce.published import Published
from imop.sim.arms import PANDA
from imop.sim.parts.grocery import GROCERIES
from imop.tasks.suites import find_suite
from imop.tasks.task import Task

Column = Literal["kept", "parameters"]
ARROW = " -> "
"""Between what is shown and what is tried, in the name of a pair."""
_CUPBOARD = "tabletop/grocery_in_cupboard"


@dataclass(frozen=True)
class Row:
    """A method in one configuration.

    Attributes:
        label: what the table calls it; unique within its section.
        method: name, see `make_policy`.
        weights: folder of its networks; None for the bundled ones.
        made_by: command that makes the weights.
        against: label of the row that it is compared with; None for the first row of its section.
        disturb: what goes wrong once in every episode; nothing if empty.
        demonstrations: how many it is shown.
        quick: whether it is tried by `--quick`, too.
    """

    label: str
    method: str
    weights: Path | None = None
    made_by: str = ""
    against: str | None = None
    disturb: str = ""
    demonstrations: int = 1
    quick: bool = True

    def tried_in(self, scenes: Mapping[str, list[Trial]]) -> dict[str, list[Trial]]:
        """The same scenes, as this row has them; tasks in which its disturbance cannot happen are left out.

        Raises:
            InvalidInput: for an unknown disturbance, or one that can happen in no task.
        """
        found = disturbed(scenes, self.disturb) if self.disturb else scenes
        return {
            task: [replace(trial, demonstrations=self.demonstrations) for trial in of_task]
            for task, of_task in found.items()
        }


@dataclass(frozen=True)
class Section:
    """Tasks on which the rows are compared. This one has published numbers only.

    Attributes:
        title: of the section.
        rows: what is tried; the first is what the others are compared with.
        published: rows of the paper.
    """

    title: str
    rows: tuple[Row, ...] = ()
    published: tuple[Published, ...] = ()

    def trials(self, episodes: int, seed: int) -> dict[str, list[Trial]]:
        """Scenes of each task, without what single rows change in them."""
        return {}

    def absent(self) -> list[str]:
        """Tasks of the section that cannot be tried because their files are not there."""
        return []

    def parts(self) -> dict[str, list[str]]:
        """Tasks that are chains of others -> these, names without the suite."""
        return {}


@dataclass(frozen=True)
class SuiteSection(Section):
    """Tasks of a suite.

    Attributes:
        suite: name of the suite.
        split: which of its tasks.
        instances: whether the scenes show the demonstrated objects or others of their kind.
        change: see `suite_trials`.
        robot: the arm that shows and acts.
    """

    suite: str = "rlbench"
    split: str = "base"
    instances: Instances = "same"
    change: str = ""
    robot: str = PANDA.name

    def trials(self, episodes: int, seed: int) -> dict[str, list[Trial]]:
        """As `imop eval` would try them.

        Raises:
            InvalidInput: if there is no such suite or split.
            AssetMissing: if no task can be tried.
        """
        other = self.instances == "other"
        trials = suite_trials(self.suite, self.split, (), episodes, seed, 0, self.change, other)
        return {
            task: [replace(trial, robot=self.robot) for trial in of_task] for task, of_task in trials.items()
        }

    def absent(self) -> list[str]:
        """Tasks of the split whose files are missing."""
        return [name for name, kind in self._kinds().items() if not kind.available()]

    def parts(self) -> dict[str, list[str]]:
        """Tasks with an attribute `parts`, the tasks that they are made of."""
        chains = {name: getattr(kind, "parts", ()) for name, kind in self._kinds().items()}
        return {name: [self._short(part.name) for part in of] for name, of in chains.items() if of}

    def _kinds(self) -> dict[str, type[Task]]:
        kinds = find_suite(self.suite).get(self.split, {})
        return {self._short(name): kind for name, kind in kinds.items()}

    def _short(self, name: str) -> str:
        return name.removeprefix(f"{self.suite}/")


@dataclass(frozen=True)
class GrocerySection(Section):
    """One of nine groceries is put into the cupboard, after the same or another one was shown.

    Attributes:
        same: whether the shown grocery is the one to be put away.
    """

    same: bool = True

    def trials(self, episodes: int, seed: int) -> dict[str, list[Trial]]:
        """Scenes of every grocery, or of every pair of others, called "shown -> tried"."""
        names = [kind.name for kind in GROCERIES]
        pairs = [(a, b) for a in range(len(names)) for b in range(len(names)) if (a == b) == self.same]
        return {
            names[a] if self.same else names[a] + ARROW + names[b]: [
                Trial(_CUPBOARD, seed + k, b, shown_variation=a) for k in range(episodes)
            ]
            for a, b in pairs
        }


@dataclass(frozen=True)
class Table:
    """One table, made by `imop reproduce NAME`.

    Attributes:
        name: of the command.
        title: above the table.
        sections: its parts; their rows and tasks may differ.
        notes: what a reader must know to compare the numbers, one sentence each.
        episodes: scenes of a task.
        focus: whether somebody points at the thing that is acted on first.
        columns: what is printed beside success and comparison: `kept`, how many of the scenes that the row
            compared with solves are solved, too; `parameters` of the networks.
    """

    name: str
    title: str
    sections: tuple[Section, ...]
    notes: tuple[str, ...] = ()
    episodes: int = 25
    focus: bool = False
    columns: tuple[Column, ...] = ()
