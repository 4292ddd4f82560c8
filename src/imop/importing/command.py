"""`imop import`: recordings of other programs become demonstrations in a store."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro
from tyro.conf import Positional

from imop.errors import InvalidInput
from imop.terminal import console, status, track

if TYPE_CHECKING:
    from collections.abc import Sequence

    from imop.demos.check_steps import TipPose
    from imop.demos.findings import Finding
    from imop.recording.draft import Draft

RawLayout = Literal["rosbag", "lerobot", "folder"]
Layout = Literal["rlbench"] | RawLayout


def import_(
    layout: Positional[Layout],
    source: Positional[Path],
    out: Positional[Path],
    cameras: Annotated[str | None, tyro.conf.arg(metavar="NAME,NAME")] = None,
    side: Path | None = None,
    setup: Path | None = None,
    episode: int | None = None,
    move: Annotated[tuple[str, ...], tyro.conf.arg(metavar="NUMBER:FRAME")] = (),
    add: Annotated[tuple[str, ...], tyro.conf.arg(metavar="FRAME")] = (),
    remove: tuple[int, ...] = (),
    dry_run: bool = False,
    picture: Path | None = None,
) -> int:
    """Convert recorded demonstrations into a store.

    Nothing that can be read is left out; what `imop check` would say about it is said. Episodes that are in
    the store already are not stored again, so an import that was stopped is continued by starting it again.
    What a recording lacks (intrinsics, poses of cameras, the scale of depth, fingers) is asked for by name.
    Bags and datasets need the extra import.

    Args:
        layout: how the recordings are laid out: rlbench as PerAct, RVT and Act3D use it; rosbag, of ROS 2
            with MCAP or SQLite, or of ROS 1; lerobot, version 3, with depth; folder, PNG, NPY or NPZ files
            with a recording.json, as `imop record` writes it.
        source: an episode, or a folder of episodes.
        out: folder of the store; an existing one is appended to.
        cameras: of rlbench, which cameras, joined by commas; by default front, left_shoulder, right_shoulder
            and wrist, as far as they were recorded.
        side: file that says what the recording lacks (docs/real_robot/importing.md).
        setup: the set-up of the cell, for cameras and arm (docs/real_robot/setup.md).
        episode: only this one, by its number.
        move: of a single episode, 2:+5 moves keyframe 2 by five frames, 2:37 to frame 37.
        add: of a single episode, frames, or times such as 4.2s, that become keyframes.
        remove: of a single episode, numbers of keyframes that are none.
        dry_run: show the keyframes and store nothing.
        picture: PNG file for what was seen in the keyframes, of a single episode.
    """
    if layout == "rlbench":
        given: dict[str, object] = {"side": side, "setup": setup, "episode": episode, "picture": picture}
        given |= {"move": move, "add": add, "remove": remove, "dry_run": dry_run}
        for name, value in given.items():
            if value not in (None, (), False):
                raise InvalidInput(name, "given for rlbench", "rosbag, lerobot or folder")
        return _rlbench(source, out, cameras)
    if cameras is not None:
        raise InvalidInput("cameras", f"given for {layout}", "a side file, whose [cameras.NAME] choose them")
    from imop.recording.edits import edited
    from imop.recording.saving import save_all
    from imop.recording.show import keyframes_table, save_picture

    with status(f"reading {source}"):
        drafts = _drafts(layout, source, side, setup, episode)
    if len(drafts) > 1 and (move or add or remove or picture is not None):
        raise InvalidInput("episode", f"one of {len(drafts)} is to be chosen", f"0 .. {len(drafts) - 1}")
    if len(drafts) == 1:
        drafts = [edited(drafts[0], move, add, remove)]
    for draft in drafts:
        console.print(f"{draft.source.name}: {len(draft.source.motion)} frames", soft_wrap=True)
        console.print(keyframes_table(draft))
    if picture is not None:
        save_picture(drafts[0], picture)
        console.print(picture)
    if dry_run:
        console.print("nothing was stored")
        return 0
    done = save_all(drafts, out, _tip_pose(setup), lambda these: track(these, f"importing {source}"))
    return _told(out, done.stored, done.there_already, done.findings)


def _drafts(
    layout: RawLayout, source: Path, side: Path | None, setup: Path | None, episode: int | None
) -> "list[Draft]":
    from imop.importing.sources import find_sources
    from imop.recording.draft import Draft
    from imop.recording.folder import RecordedFolder
    from imop.recording.keyframes_file import load_draft

    found = find_sources(layout, source, side, setup)
    if episode is not None:
        if not 0 <= episode < len(found):
            raise InvalidInput("episode", f"{episode}", f"0 .. {len(found) - 1}")
        found = found[episode : episode + 1]
    # Who changed the keyframes of a recording meant it.
    return [
        load_draft(one.folder, one) if isinstance(one, RecordedFolder) else Draft.of(one) for one in found
    ]


def _tip_pose(setup: Path | None) -> "TipPose | None":
    from imop.setup.arm import arm_of
    from imop.setup.file import load_setup

    return None if setup is None else arm_of(load_setup(setup)).tip_pose


def _rlbench(source: Path, out: Path, cameras: str | None) -> int:
    from imop.demos.rlbench_import import import_rlbench
    from imop.robots.panda import tip_pose

    names = None if cameras is None else cameras.split(",")
    done = import_rlbench(source, out, names, tip_pose, lambda these: track(these, f"importing {source}"))
    return _told(out, done.stored, done.there_already, done.findings)


def _told(out: Path, stored: int, there_already: int, findings: "Sequence[Finding]") -> int:
    for finding in findings:
        console.print(str(finding))
    console.print(f"{stored} demonstrations imported into {out}, {there_already} were there already")
    return 1 if any(finding.severity == "error" for finding in findings) else 0
