"""One demonstration, performed by the robot of a set-up, and what is kept of it."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path

from imop.errors import ImopError, InvalidInput, MissingExtra
from imop.evaluation.methods import make_policy
from imop.evaluation.report import save_json
from imop.evaluation.steps import Rollout, Step
from imop.geometry.focus import Focus
from imop.setup.drivers import SimulatedScene, connected
from imop.setup.file import load_setup
from imop.types import Action, Demonstration, FloatArray, Observation
from imop.viewing.alone import go_on
from imop.viewing.cases import Case
from imop.viewing.confirm import attend
from imop.viewing.deciders import Decider
from imop.viewing.look import Look
from imop.viewing.robot import LAST_STEP, RobotWorld
from imop.viewing.scene_of import SceneOf
from imop.viewing.session import Session
from imop.viewing.worlds import Outcome, World

MOST = 3
"""So many times as many actions as were demonstrated are done at most, unless somebody attends."""
STOPPED = "stopped by who attended"


@contextmanager
def on_robot(
    file: Path,
    demonstration: Demonstration,
    method: str = "learned",
    weights: Path | None = None,
    scene: SceneOf | None = None,
) -> Iterator[tuple[Case, Callable[[], bool | None]]]:
    """The robot of a set-up, connected, as a case; and whether the aim is reached, if anybody knows.

    Args:
        file: the set-up.
        demonstration: in the world frame of the set-up.
        method: who decides.
        weights: of the method.
        scene: of a simulated robot.

    Raises:
        ImopError, ConnectionError: as `load_setup` and `connected`; for a scene of a real robot.
    """
    setup = load_setup(file)
    if scene is not None and setup.robot.driver != "simulated":
        raise InvalidInput("task", scene.task, f"no task, for the robot's driver is {setup.robot.driver!r}")
    made, reached = (None, lambda: None) if scene is None else _made(scene, setup.robot.model)
    with connected(setup, made) as (robot, cameras):
        world = RobotWorld(setup, robot, cameras, len(demonstration))
        yield Case(demonstration, world, method, weights, f"{file}", recovers=True), reached


def _made(scene: SceneOf, robot: str) -> tuple[SimulatedScene, Callable[[], bool]]:
    from imop.evaluation.trials import Trial
    from imop.tasks.task import watching

    env = Trial(scene.task, scene.seed, scene.variation, scene.instance, robot=robot).env()
    return SimulatedScene(env.world, watching(env.task, None)), env.wait


def perform_on_robot(
    file: Path,
    demonstration: Demonstration,
    out: Path,
    method: str = "learned",
    weights: Path | None = None,
    min_confidence: float = 0.0,
    scene: SceneOf | None = None,
    ask: Callable[[str], str] | None = None,
    tell: Callable[[str], object] = lambda words: None,
    origin: dict[str, object] | None = None,
) -> Rollout:
    """Look, decide and move until the demonstrated steps are done, and write result.json and steps.png.

    The episode has succeeded if the last demonstrated step was done; on a simulated robot, if the task says
    so. Both files are written even if it is interrupted.

    Args:
        file: the set-up.
        demonstration: in the world frame of the set-up.
        out: folder for the files; the picture needs the extra viz.
        method: who decides.
        weights: of the method.
        min_confidence: of the method; below it nothing moves.
        scene: of a simulated robot.
        ask: puts a question before every motion; by default nobody is asked.
        tell: says what happens.
        origin: goes into result.json too.

    Raises:
        ImopError, ConnectionError: as `on_robot`, and if nothing can be seen at the beginning.
    """
    with on_robot(file, demonstration, method, weights, scene) as (case, reached):
        policy = make_policy(method, min_confidence=min_confidence, weights=weights, robot=f"{file}")
        log = _Log(case.decider(policy), case.world)
        reason, success = "interrupted", False
        try:
            session = Session(log, log)
            if ask is None:
                reason = go_on(session, MOST * len(demonstration), tell)
            else:
                reason = "" if attend(session, ask, tell) else STOPPED
            aim = reached()
            if aim is None:
                success, reason = not reason, reason or LAST_STEP
            else:
                success, reason = aim, "success" if aim else reason or "task not done after the last action"
        except (ImopError, ConnectionError) as error:
            reason = f"{error}"
            raise
        finally:
            result = Rollout(success, reason, tuple(log.steps))
            told = {
                "setup": f"{file}",
                **(asdict(scene) if scene else {}),
                "method": method,
                **(origin or {}),
            }
            save_json({**told, **result.as_dict()}, out / "result.json")
            _draw(log, demonstration, out / "steps.png", tell)
    return result


class _Log:
    """A decider and a world that keep what was decided and done."""

    def __init__(self, decider: Decider, world: World) -> None:
        self._decider, self._world = decider, world
        self.steps: list[Step] = []
        self.done: list[tuple[Observation, Action]] = []
        self._seen: Observation | None = None
        self._seconds = 0.0

    def reset(self) -> None:
        self._decider.reset()

    def decide(self, observation: Observation, focus: Focus | None = None) -> Look:
        started = time.perf_counter()
        look = self._decider.decide(observation, focus)
        self._seconds = time.perf_counter() - started
        return look

    def take(self, number: int) -> None:
        self._decider.take(number)

    def observe(self) -> Observation:
        self._seen = self._world.observe()
        return self._seen

    def way(self, action: Action) -> FloatArray:
        return self._world.way(action)

    def known(self) -> FloatArray | None:
        return self._world.known()

    def perform(self, action: Action) -> Outcome:
        assert self._seen is not None
        self.done.append((self._seen, action))
        started = time.perf_counter()
        try:
            outcome = self._world.perform(action)
        except BaseException as error:
            self._keep(action, started, type(error).__name__)
            raise
        self._keep(action, started, outcome.failed)
        return outcome

    def stop(self) -> None:
        self._world.stop()

    def _keep(self, action: Action, started: float, failed: str | None) -> None:
        match = action.match
        self.steps.append(
            Step(
                None if match is None else match.step,
                None,
                None,
                action.confidence,
                self._seconds,
                time.perf_counter() - started,
                failed,
                "" if match is None else match.generator,
                action.reachable,
            )
        )


def _draw(log: _Log, demonstration: Demonstration, path: Path, tell: Callable[[str], object]) -> None:
    if not log.done:
        return
    try:
        from imop.evaluation.picture import Panel, save_picture
    except MissingExtra as error:
        tell(f"no picture: {error}")
        return
    save_picture(
        [
            Panel(
                demonstration.keyframes[number if action.match is None else action.match.step],
                seen,
                action,
                f"action {number}",
            )
            for number, (seen, action) in enumerate(log.done)
        ],
        path,
    )
