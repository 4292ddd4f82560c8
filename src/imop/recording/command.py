"""`imop record`: record a demonstration, look at its keyframes, change them, and store it."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro
from tyro.conf import Positional

from imop.errors import ImopError, InvalidInput
from imop.terminal import console, status

if TYPE_CHECKING:
    from imop.calibration.collect import Rig
    from imop.recording.draft import Draft
    from imop.setup.setup import Setup

_HELP = "move 2:+5, add 40, remove 3, picture, save, quit"


@dataclass(frozen=True)
class Simulation:
    """An expert on the simulator instead of an arm."""

    simulated: Annotated[str, tyro.conf.arg(metavar="SUITE/TASK")] = ""
    """task that the expert does, such as tabletop/open_drawer"""
    robot: str = "panda"
    """its arm: panda, iiwa14 or ur5e; all but the Panda need the extra arms"""
    seed: int = 0
    """scene, and noise of the sensors"""
    variation: int = 0
    """which variation of the task"""
    instance: int = 0
    """seed of the things' shapes, sizes and colours"""
    size: tuple[int, int] = (128, 128)
    """width and height of the images, pixels"""
    clean: bool = False
    """without the noise of D415 cameras and encoders"""


def record(
    folder: Positional[Path],
    simulation: Annotated[Simulation, tyro.conf.OmitArgPrefixes],
    setup: Path | None = None,
    rig: Annotated[str, tyro.conf.arg(metavar="MODULE:FUNCTION")] = "",
    rate: float = 15.0,
    kind: Literal["kinesthetic", "teleoperated"] = "kinesthetic",
    task: str = "",
    instruction: str = "",
    move: Annotated[tuple[str, ...], tyro.conf.arg(metavar="NUMBER:FRAME")] = (),
    add: Annotated[tuple[str, ...], tyro.conf.arg(metavar="FRAME")] = (),
    remove: tuple[int, ...] = (),
    store: Path = Path("demonstrations.zarr"),
    save: bool = False,
) -> int:
    """Record a demonstration, find its keyframes, let them be changed, and store it.

    An empty folder is recorded into, until Enter is pressed; an interrupted recording is gone on with; of one
    that has ended, the keyframes are shown and changed. A crash loses at most the last second. In a terminal
    it asks what to do; without one, or with --save, it does what the options say.

    Args:
        folder: of the recording: new, or as an earlier call left it.
        simulation: the expert, if it is no real arm.
        setup: the set-up (docs/real_robot/setup.md), for a real arm; it may name the drivers.
        rig: module:function that returns other drivers of arm and cameras, an imop.calibration.collect.Rig.
        rate: frames per second.
        kind: how the task is shown.
        task: a name for it, for bookkeeping.
        instruction: the task in words.
        move: 2:+5 moves keyframe 2 by five frames, 2:37 to frame 37, 2:4.2s to 4.2 seconds.
        add: frames, or times such as 4.2s, that become keyframes.
        remove: numbers of keyframes that are none; numbers are those of the table, before any change.
        store: to save the demonstration into; made if it does not exist.
        save: save it without asking.
    """
    from imop.recording.edits import edited
    from imop.recording.folder import KEYFRAMES, is_recording
    from imop.recording.keyframes_file import load_draft, save_draft

    if is_recording(folder) and (folder / KEYFRAMES).exists():
        if simulation.simulated or rig or setup:
            console.print(f"{folder} holds a recording that has ended; a new one needs a new folder")
        draft = load_draft(folder)
    elif simulation.simulated:
        draft = _simulated(folder, simulation, rate)
    elif rig or setup:
        draft = _live(folder, setup, rig, rate, kind, task, instruction)
    elif is_recording(folder):
        draft = load_draft(folder)
        console.print(f"{folder}: the recording ends here; with --setup or --simulated it would go on")
    else:
        accepted = "--setup FILE of a real arm, or --simulated SUITE/TASK"
        raise InvalidInput("setup", f"missing, and nothing is recorded in {folder}", accepted)
    draft = edited(draft, move, add, remove)
    save_draft(draft, folder)
    _show(draft, folder)
    if save:
        return _save(draft, store)
    if sys.stdin.isatty():
        return _ask(draft, folder, store)
    console.print(f"not stored yet; `imop record {folder} --save` stores it in {store}")
    return 0


def _simulated(folder: Path, simulation: Simulation, rate: float) -> "Draft":
    from imop.recording.simulated import CLEAN, Noise, record_expert

    with status(f"recording the expert at {simulation.simulated}"):
        draft, _ = record_expert(
            folder,
            simulation.simulated,
            robot=simulation.robot,
            seed=simulation.seed,
            variation=simulation.variation,
            instance=simulation.instance,
            rate=rate,
            size=simulation.size,
            noise=CLEAN if simulation.clean else Noise(),
        )
    return draft


def _live(
    folder: Path,
    setup: Path | None,
    rig: str,
    rate: float,
    kind: Literal["kinesthetic", "teleoperated"],
    task: str,
    instruction: str,
) -> "Draft":
    from imop.recording.live import record_live, typed_lines
    from imop.recording.recorder import DemonstrationRecorder
    from imop.setup.file import load_setup

    if setup is None:
        accepted = "the set-up, which says where cameras and arm stand (docs/real_robot/setup.md)"
        raise InvalidInput("setup", "missing", accepted)
    known = load_setup(setup)
    words = (instruction,) if instruction else ()
    with (
        _drivers(known, rig) as drivers,
        DemonstrationRecorder.start(folder, known, task=task, instructions=words, kind=kind) as recorder,
    ):
        if recorder.count:
            console.print(f"{folder}: goes on after {recorder.count} frames")
        console.print("recording; Enter ends it, o Enter and c Enter open and close the gripper")
        record_live(recorder, drivers, rate, typed_lines())
    return recorder.stop()


@contextmanager
def _drivers(setup: "Setup", rig: str) -> Iterator["Rig"]:
    """Those of a function, or, without a name, those that the set-up names."""
    from imop.calibration.collect import Rig
    from imop.calibration.command import find_rig
    from imop.setup.drivers import connected

    if rig:
        yield find_rig(rig)
        return
    with connected(setup) as (robot, cameras):
        yield Rig(robot, cameras)


def _show(draft: "Draft", folder: Path) -> None:
    from imop.recording.show import keyframes_table

    motion = draft.source.motion
    length = motion.times[-1] - motion.times[0]
    console.print(f"{folder}: {len(motion)} frames, {length:.1f} s, {len(draft.frames) - 1} keyframes")
    console.print(keyframes_table(draft))
    _picture(draft, folder)


def _picture(draft: "Draft", folder: Path) -> None:
    from imop.recording.show import save_picture

    try:
        save_picture(draft, folder / "keyframes.png")
        console.print(folder / "keyframes.png")
    except InvalidInput as error:  # what is lacking is asked for when it is stored
        console.print(f"no picture: {error}", style="yellow")


def _ask(draft: "Draft", folder: Path, store: Path) -> int:
    """What to do with it, until it is saved or left."""
    from imop.recording.keyframes_file import save_draft

    while True:
        typed = console.input(f"{_HELP}: ").strip()
        word, _, rest = typed.partition(" ")
        if word in ("quit", "q"):
            console.print(f"not stored; the recording stays in {folder}")
            return 0
        try:
            if word in ("save", "s"):
                return _save(draft, store)
            if word == "picture":
                _picture(draft, folder)
            elif (change := _changes(word, rest)) is not None:
                draft = change(draft)
                save_draft(draft, folder)
                _show(draft, folder)
        except ImopError as error:
            console.print(str(error), style="red")


def _changes(word: str, rest: str) -> "Callable[[Draft], Draft] | None":
    from imop.recording.edits import edited

    if word == "move":
        return lambda draft: edited(draft, (rest,), (), ())
    if word == "add":
        return lambda draft: edited(draft, (), (rest,), ())
    if word == "remove":
        number = int(rest) if rest.strip().isdigit() else -1
        return lambda draft: edited(draft, (), (), (number,))
    return None


def _save(draft: "Draft", store: Path) -> int:
    from imop.recording.saving import save_all

    with status(f"storing {draft.source.name}"):
        done = save_all([draft], store)
    for finding in done.findings:
        console.print(str(finding), soft_wrap=True)
    there = "; it was there already" if done.there_already else ""
    console.print(f"{draft.source.name} is in {store}{there}")
    return 1 if any(finding.severity == "error" for finding in done.findings) else 0
