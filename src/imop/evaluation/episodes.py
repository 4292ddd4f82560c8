"""Episodes that were tried, one line each in a file: a benchmark that is stopped goes on where it was."""

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import dacite

import imop.baselines
import imop.demos
import imop.evaluation.textbook
import imop.geometry
import imop.networks
import imop.policy
import imop.robots
import imop.sim
import imop.tasks
from imop.baselines.policy import FOLDER, PARTS, REGRESSORS
from imop.errors import CorruptData
from imop.evaluation.fingerprint import code_digest, own_code_digest, weights_digest
from imop.evaluation.methods import METHODS, find_method
from imop.evaluation.trials import Trial
from imop.networks.model import BUNDLED
from imop.tasks.suites import find_task


@dataclass(frozen=True)
class Episode:
    """How one method did in one scene.

    Attributes:
        trial: the scene.
        method: its name.
        state: of code and weights, see `method_state`.
        success: whether the task was done; None if the objects of the scene found no place.
        reason: why the episode ended.
        actions: how many were taken.
        decisions: who proposed each action, and with which probability of being right.
        error: whether it ended because something could not be handled, which counts as a failure.
        disturbed: whether the disturbance of the trial happened.
    """

    trial: Trial
    method: str
    state: str
    success: bool | None
    reason: str
    actions: int = 0
    decisions: tuple[tuple[str, float], ...] = ()
    error: bool = False
    disturbed: bool = False


class EpisodeLog:
    """A file of episodes, read when opened and appended to.

    Args:
        path: the file, made when the first episode is added.

    Raises:
        CorruptData: if a line other than an unfinished last one cannot be read.
    """

    def __init__(self, path: Path):
        self._path = path
        _cut(path)
        self._episodes = {(e.trial, e.method, e.state): e for e in read_episodes(path)}

    def find(self, trial: Trial, method: str, state: str) -> Episode | None:
        """The episode, or None if it was not tried in this state."""
        return self._episodes.get((trial, method, state))

    def add(self, episode: Episode) -> None:
        """Keep a further episode."""
        self._path.parent.mkdir(parents=True, exist_ok=True)
        with self._path.open("a") as file:
            file.write(json.dumps(asdict(episode)) + "\n")
        self._episodes[episode.trial, episode.method, episode.state] = episode


def method_state(method: str, weights: Path | None, task: str) -> str:
    """Digest of the code that decides how a method does in a task, and of its weights if it has some."""
    digests = [code_digest(imop.sim, imop.robots, imop.tasks, imop.geometry)]
    if method not in ("expert", "oracle", "replay"):
        deciding = imop.policy, imop.networks, imop.demos, imop.evaluation.textbook
        digests.append(code_digest(*deciding))
    if method in ("learned", "registration", "advancing", "paper"):
        digests.append(weights_digest(weights or BUNDLED))
    if method in REGRESSORS:
        digests.append(code_digest(imop.baselines))
        digests += [weights_digest((weights or FOLDER) / part) for part in PARTS[method]]
    own = [find_task(task)] + ([] if method in METHODS else [find_method(method)])
    return "-".join([*digests, *own_code_digest(*own)])


def read_episodes(path: Path) -> Iterator[Episode]:
    """The episodes of a file, in order; none if there is no file. A last line without an end is left out.

    Raises:
        CorruptData: if a line cannot be read.
    """
    whole = path.read_bytes().rpartition(b"\n")[0] if path.is_file() else b""
    for number, line in enumerate(whole.splitlines(), start=1):
        try:
            fields = json.loads(line)
            if not isinstance(fields, dict):
                raise TypeError("not an object")
            yield dacite.from_dict(Episode, fields, dacite.Config(cast=[tuple], strict=True))
        except (ValueError, TypeError, dacite.DaciteError) as error:
            problem = f"line {number} is no episode ({error})"
            raise CorruptData(path, problem, "lines as `imop eval` writes them") from error


def _cut(path: Path) -> None:
    """Remove a last line without an end: what follows must begin on a new one."""
    text = path.read_bytes() if path.is_file() else b""
    if not text.endswith(b"\n") and text:
        with path.open("r+b") as file:
            file.truncate(text.rfind(b"\n") + 1)
