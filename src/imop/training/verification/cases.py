"""What the verification network is trained on: candidates of the search itself, and which of them are right.

imop training cases --out DIR --cases N --seed S [--weights FOLDER] [--jobs J] [--mix ...]
imop training cases --out DIR --cases N --seed S --store BASE.zarr --others 0.7

A case is one step of a demonstration, procedural or recorded, and one scene in which it has to be done. The
networks find its region, the search proposes motions stage by stage, and the known poses (of recorded things
the recorded actions) say which of them take the gripper to where it may go. In some set-ups the cameras are
not quite where they are said to be, and some scenes are others, in which nothing of what was shown is there
and no candidate is right.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray

from imop.demos.store import DemonstrationStore
from imop.files import replaced
from imop.geometry import se3
from imop.geometry.accuracy import COARSE
from imop.networks.model import BUNDLED, Model, load_model
from imop.policy.interfaces import BEGINNING, Progress
from imop.policy.learned import LearnedMatcher
from imop.policy.registration import RegistrationMatcher
from imop.policy.verification import Pool
from imop.training.data.executed import AnyDemonstration, ExecutedStep
from imop.training.recorded.write import recorded_executions
from imop.training.synthetic.families import TRAINING
from imop.training.synthetic.pairs import synthetic_executions
from imop.training.synthetic.plans import check_kinds
from imop.training.verification.set_up import SetUp
from imop.types import Float32Array, FloatArray, Observation

# Share of the later steps that are asked as the first of an episode, too.
AFRESH = 0.3
# Share of the others that are told what the search answered before; the rest is told what was right.
ANSWERED = 0.7
# How far the motion that was found for the step before may be off, metres and radians.
HINT_OFF = (0.003, 0.03)
# Share of the cases that the search with descriptors instead of networks gives.
REGISTERED = 0.15
# Share of the demonstrations whose first step is also looked for where its things are not.
ABSENT = 0.3
# Share of the set-ups whose cameras are said to be somewhere else.
MISPLACED = 0.3
_PER_FILE = 20

Judged = tuple[Float32Array, Float32Array, Float32Array]
"""Evidence (H, |EVIDENCE|) of candidates, (H, 4, 4) where they take the gripper, and (H,) how far they are
off; see `Cases`."""
Execution = tuple[Sequence[ExecutedStep[AnyDemonstration]], Observation | None]
"""The steps of one demonstration and query, and how an execution with other things begins, or None."""


@dataclass(frozen=True, eq=False)
class Cases:
    """Candidates of several cases.

    Attributes:
        evidence: (N, |EVIDENCE|) of them.
        goals: (N, 4, 4) where they take the gripper.
        off: (N,) how far the candidate is from a right one, in what is still right (`accuracy.COARSE`).
        case: (N,) the number of the case and stage that it belongs to, not decreasing.
    """

    evidence: Float32Array
    goals: Float32Array
    off: Float32Array
    case: NDArray[np.int64]


def make_cases(
    model: Model, executions: Iterable[Execution], rng: np.random.Generator, count: int
) -> list[list[Judged]]:
    """The candidates of each of `count` cases, for each stage of the search; fewer if the executions end."""
    found: list[list[Judged]] = []
    matchers = LearnedMatcher(model), RegistrationMatcher(model.verification)
    for group, elsewhere in executions:
        if len(found) >= count:
            break
        matcher = matchers[int(rng.random() < REGISTERED)]
        set_up = SetUp.misplaced(group[0].shown, rng) if rng.random() < MISPLACED else SetUp()
        without = elsewhere if rng.random() < ABSENT else None
        found += _cases(group, matcher, set_up, rng, without)
    return found[:count]


def _cases(
    group: Sequence[ExecutedStep[AnyDemonstration]],
    matcher: LearnedMatcher | RegistrationMatcher,
    set_up: SetUp,
    rng: np.random.Generator,
    elsewhere: Observation | None,
) -> list[list[Judged]]:
    """The cases of one demonstration and one query, in the order of their steps.

    Given how an execution with other things begins, the first step is looked for there, too.
    """
    prepared = matcher.prepare(set_up.transitions(group[0].shown))
    found, answers = [], dict[int, FloatArray]()
    if elsewhere is not None:
        pools = prepared[0].search.pools(set_up.see(elsewhere), BEGINNING)
        found.append([_judged(pool, np.zeros((0, 4, 4))) for pool in pools if pool.motions])
    for example in group:
        progress, right = _progress(example, group, answers, rng), example.right_poses()
        stages = []
        query = set_up.see(example.asked.observations[example.step])
        for pool in prepared[example.step].search.pools(query, progress):
            if pool.motions:
                stages.append(_judged(pool, right))
                answers[example.step] = pool.best(1)[0]
        found.append(stages)
    return found


def _progress(
    example: ExecutedStep[AnyDemonstration],
    group: Sequence[ExecutedStep[AnyDemonstration]],
    answers: Mapping[int, FloatArray],
    rng: np.random.Generator,
) -> Progress:
    """What was done before: what the search answered then, right or wrong, or about what was right.

    Nothing for the first step, and for some others.
    """
    before = next((e for e in group if e.step == example.step - 1), None)
    if before is None or rng.random() < AFRESH:
        return BEGINNING
    if before.step in answers and rng.random() < ANSWERED:
        return Progress(answers[before.step])
    distance, angle = HINT_OFF
    right = before.pair.T_query_support
    T = right[int(rng.integers(len(right)))]
    p = se3.apply(T, example.pair.T_world_goal[None, :3, 3])[0]
    R = se3.euler(*rng.normal(0, angle / 2, 3))
    off = se3.make(R, p - R @ p + rng.normal(0, distance, 3))
    return Progress(off @ T)


def _judged(pool: Pool, right: FloatArray) -> Judged:
    """A pool's candidates, where the gripper may go to poses (S, 4, 4)."""
    goals = pool.goals()
    evidence, off = pool.evidence(), off_goals(goals, right)
    return evidence.astype(np.float32), goals.astype(np.float32), off.astype(np.float32)


def off_goals(goals: FloatArray, right: FloatArray) -> FloatArray:
    """(H,) how far poses (H, 4, 4) are from the nearest right one of (S, 4, 4); infinite if there is none.

    Below 1 is what counts as right: 1 is as far away, or turned as much, as `accuracy.COARSE` says.
    """
    distance, angle = COARSE
    away = se3.translation_distance(goals[:, None], right[None]) / distance
    turned = se3.rotation_distance(goals[:, None], right[None]) / np.radians(angle)
    return np.asarray(np.maximum(away, turned).min(axis=1, initial=np.inf))


def write_cases(cases: Sequence[Sequence[Judged]], path: Path) -> None:
    """One file, whole or not at all."""
    stages = [stage for case in cases for stage in case]
    evidence, goals, off = (np.concatenate(columns) for columns in zip(*stages, strict=True))
    case = np.repeat(np.arange(len(stages)), [len(off) for *_, off in stages])
    with replaced(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, evidence=evidence, goals=goals, off=off, case=case)


def read_cases(*folders: Path) -> Cases:
    """All cases of some folders."""
    parts, start = [], 0
    for path in (path for folder in folders for path in sorted(folder.glob("*.npz"))):
        with np.load(path) as file:
            evidence, goals, off, case = (file[name] for name in ("evidence", "goals", "off", "case"))
        parts.append((evidence, goals, off, case + start))
        start += int(case.max()) + 1
    return Cases(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


@dataclass(frozen=True)
class CasesConfig:
    """How to make cases.

    Attributes:
        out: folder of the files; those that are there already are kept.
        cases: how many.
        seed: of everything that is drawn.
        weights: folder of the networks that search.
        mix: shares of cases with the same things, others in colour, in shape, in both.
        kinds: of what is done in procedural ones (`plans.SHARES`); all if none is named.
        store: of recorded demonstrations that the cases are of, instead of procedural ones.
        others: share of those whose query shows other objects than the demonstration.
        jobs: processes.
    """

    out: Path
    cases: int
    seed: int = 0
    weights: Path = BUNDLED
    mix: tuple[float, float, float, float] = (0.35, 0.1, 0.25, 0.3)
    kinds: tuple[str, ...] = ()
    store: Path | None = None
    others: float = 0.0
    jobs: int = 1


def _executions(config: CasesConfig, seed: int, rng: np.random.Generator) -> Iterator[Execution]:
    if config.store is None:
        return synthetic_executions(TRAINING, config.mix, seed, rng, config.kinds)
    return recorded_executions(DemonstrationStore.open(config.store, verify=False), seed, config.others)


def _file(config: CasesConfig, number: int) -> None:
    path = config.out / f"cases-{number:05d}.npz"
    if not path.exists():
        content = int(np.random.SeedSequence([config.seed, number]).generate_state(1)[0])
        size = min(_PER_FILE, config.cases - number * _PER_FILE)
        rng = np.random.default_rng((content, 7))
        made = make_cases(load_model(config.weights), _executions(config, content, rng), rng, size)
        write_cases(made, path)
        print(path, flush=True)


def case_files(config: CasesConfig) -> None:
    """Make the cases, in files of a folder; files that are there stay.

    Raises:
        InvalidInput: if there is no such kind.
    """
    check_kinds(config.kinds)
    config.out.mkdir(parents=True, exist_ok=True)
    files = -(-config.cases // _PER_FILE)
    Parallel(n_jobs=config.jobs)(delayed(_file)(config, number) for number in range(files))
