"""`imop view`: look at what the policy understood, and let it act, in a browser."""

import threading
from pathlib import Path
from typing import TYPE_CHECKING

from imop.errors import InvalidInput
from imop.files import replaced, writable_folder
from imop.terminal import console, list_folder, status
from imop.viewing.scene_of import SceneOf

if TYPE_CHECKING:
    from contextlib import ExitStack

    from imop.evaluation.methods import Policy
    from imop.viewing.cases import Case

SIZE = (1600, 760)
"""Of a picture, pixels."""


def view(
    task: str | None = None,
    seed: int = 1,
    variation: int = 0,
    instance: int = 0,
    demo: Path | None = None,
    demo_episode: int = 0,
    scene: Path | None = None,
    scene_episode: int = 0,
    result: Path | None = None,
    method: str = "learned",
    weights: Path | None = None,
    base: tuple[float, float, float] | None = None,
    robot: str = "panda",
    server: str | None = None,
    key: str | None = None,
    host: str = "127.0.0.1",
    port: int = 8080,
    ahead: int | None = None,
    confirm: bool = False,
    screenshot: Path | None = None,
) -> int:
    """Show in a browser what the policy understood: region, matches, candidates, predicted gripper, path.

    Of a recording (--demo and --scene), of a result.json of `imop run` or `imop predict` (--result), or live
    on the simulator (--task) or a robot (--robot CELL.toml and --demo), where a button performs what is
    shown. Needs the extra view; a task sim, too.

    Args:
        task: suite and name of a task to perform on the simulator, such as tabletop/lid_off_pot.
        seed: scene to perform it in.
        variation: which variation of the task.
        instance: seed of the objects' shapes, sizes and colours.
        demo: store or folder of RLBench's layout with the demonstration; with a task, one is recorded if it
            is not given.
        demo_episode: which of its episodes.
        scene: store or folder with a recorded episode to predict.
        scene_episode: which of its episodes.
        result: a result.json; its scenes and its demonstration are made or read again, and decided anew.
        method: as in `imop run`.
        weights: folder that `imop train` wrote; by default the bundled weights.
        base: where the robot's base is in the recordings' frame, metres, as in `imop predict`.
        robot: whose points are left out and which poses are reached, as in `imop predict`; with neither
            scene nor result the robot of a set-up file (.toml or .json), which then moves.
        server: address of an `imop serve` that decides instead, such as 127.0.0.1:8000.
        key: that the server asks for.
        host: address to listen on; by default only this machine can look.
        port: of the page.
        ahead: so many decisions are accepted before anything is shown; all of a result if not given, and none
            of anything else.
        confirm: ask in the terminal before every motion, without a browser.
        screenshot: PNG file to write instead of waiting for somebody; needs Chromium.
    """
    from contextlib import ExitStack

    from imop.viewing.confirm import attend
    from imop.viewing.session import Session

    shown = None if demo is None else (demo, demo_episode)
    watched = None if scene is None else (scene, scene_episode)
    with ExitStack() as stack:
        with status("reading, watching and deciding"):
            stands_in = None if task is None else SceneOf(task, seed, variation, instance)
            case = _case(stands_in, shown, watched, result, method, weights, base, robot, stack)
            policy = None if server is None else _client(server, key, stack)
            session = Session(case.decider(policy), case.world)
            for _ in range(case.steps if ahead is None and result is not None else ahead or 0):
                if not session.over:
                    session.accept()
        if confirm:
            from rich.markdown import Markdown

            done = attend(session, console.input, lambda text: console.print(Markdown(text)))
            return 0 if done else 1
        from imop.viewing.window import Window

        with Window(session, host, port) as window:
            if screenshot is not None:
                from imop.viewing.browser import picture

                with replaced(screenshot) as temporary:
                    temporary.write_bytes(picture(window.url, SIZE))
                console.print(screenshot)
                return 0
            console.print(f"{window.url} shows it, until this command is interrupted")
            threading.Event().wait()
    return 0


def _case(
    task: SceneOf | None,
    demo: tuple[Path, int] | None,
    scene: tuple[Path, int] | None,
    result: Path | None,
    method: str,
    weights: Path | None,
    base: tuple[float, float, float] | None,
    robot: str,
    stack: "ExitStack",
) -> "Case":
    """What is looked at: of a robot, a task, a recording or a result, whichever is named."""
    from imop.demos.load import load_demonstration
    from imop.viewing.cases import from_result, recorded, simulated

    on_cell = robot.endswith((".toml", ".json")) and scene is None and result is None
    named = {"robot": on_cell, "task": not on_cell and task, "scene": scene, "result": result}
    chosen = [name for name, given in named.items() if given]
    if len(chosen) != 1:
        problem = f"{' and '.join(chosen) or 'nothing'} given"
        raise InvalidInput("view", problem, "one of task, scene, result, and a set-up file as robot")
    if result is not None:
        return from_result(result)
    if task is not None and not on_cell:
        from imop.evaluation.trials import Trial

        trial = Trial(task.task, task.seed, task.variation, task.instance, robot=robot)
        return simulated(trial, demo, method, weights)
    if demo is None:
        raise InvalidInput("demo", "missing", "the demonstration, beside the robot or what was recorded")
    if scene is not None:
        return recorded(demo, scene, method, weights, base, robot)
    from imop.viewing.on_robot import on_robot

    shown = load_demonstration(*demo)
    case, _ = stack.enter_context(on_robot(Path(robot), shown, method, weights, task))
    return case


def _client(server: str, key: str | None, stack: "ExitStack") -> "Policy":
    from imop.serving.client import Client

    return stack.enter_context(Client(server, None, key))


def run_on_robot(
    file: Path,
    demo: tuple[Path, int] | None,
    out: Path,
    method: str,
    weights: Path | None,
    min_confidence: float,
    scene: SceneOf | None,
    confirm: bool,
) -> int:
    """`imop run --robot FILE`; see `perform_on_robot`."""
    from rich.markdown import Markdown

    from imop.demos.load import load_demonstration
    from imop.evaluation.steps import steps_table
    from imop.viewing.on_robot import perform_on_robot

    if demo is None:
        raise InvalidInput("demo", "missing", "a store or folder with a demonstration of this set-up")
    writable_folder(out)
    with status(f"reading {demo[0]}"):
        shown = load_demonstration(*demo)
    origin = {"demo": f"{demo[0]}", "demo_episode": demo[1], "weights": weights and f"{weights}"}
    result = perform_on_robot(
        file,
        shown,
        out,
        method,
        weights,
        min_confidence,
        scene,
        console.input if confirm else None,
        lambda words: console.print(Markdown(words)),
        origin,
    )
    console.print(steps_table(result))
    style = "green" if result.success else "red"
    console.print(f"{file}: {'success' if result.success else 'failed'}: {result.reason}", style=style)
    list_folder(out)
    return 0 if result.success else 1
