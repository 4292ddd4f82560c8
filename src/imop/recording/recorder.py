"""Writes a recording while it happens, so that a crash loses at most its last second."""

import json
import os
import threading
from collections import deque
from collections.abc import Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, Self

import numpy as np

from imop.cameras.interfaces import Frame
from imop.errors import InvalidInput
from imop.files import writable_folder
from imop.recording.draft import Draft
from imop.recording.folder import (
    FRAMES,
    KEYFRAMES,
    Recorded,
    RecordedCamera,
    RecordedFolder,
    is_recording,
    read_folder,
    whole_lines,
)
from imop.recording.images import DEPTH_STEP, write_color, write_depth
from imop.recording.keyframes_file import load_draft, save_draft
from imop.robots.interfaces import RobotState
from imop.setup.setup import Setup

Kind = Literal["kinesthetic", "teleoperated", "scripted"]
UNWRITTEN = 0.5
"""Seconds of a recording that may not be on disk yet."""
_WORKERS = 4


@dataclass(frozen=True, eq=False)
class _Pending:
    """A frame whose images are being written."""

    recorded: Recorded
    images: Sequence[Future[None]]


class _Syncing:
    """Has the system write what a failure of the power would lose; a slow disk holds nobody up."""

    def __init__(self) -> None:
        self._thread: threading.Thread | None = None

    def ask(self) -> None:
        if self._thread is None or not self._thread.is_alive():
            self._thread = threading.Thread(target=os.sync, daemon=True)
            self._thread.start()


class DemonstrationRecorder:
    """Appends what is seen and measured to a folder; `stop` finds the keyframes.

    Make one with `start`, which also continues a recording that was interrupted. It is a context manager:
    leaving it writes all frames, and after an exception the recording can be continued.

    Attributes:
        folder: of the recording.
        count: frames so far.
        last: the last frame's stamp, seconds; None before the first.
    """

    def __init__(self, setup: Setup, recording: RecordedFolder):
        self.folder, self._setup, self._recording = recording.folder, setup, recording
        self.count = len(recording.frames)
        self.last = recording.frames[-1].stamp if recording.frames else None
        self._intrinsics = {name: camera.intrinsics for name, camera in recording.cameras.items()}
        self._lines = (self.folder / FRAMES).open("ab")
        self._synced = self.last
        self._pool = ThreadPoolExecutor(_WORKERS)
        self._pending: deque[_Pending] = deque()
        self._syncing = _Syncing()

    @classmethod
    def start(
        cls,
        folder: Path,
        setup: Setup,
        *,
        task: str = "",
        instructions: Sequence[str] = (),
        kind: Kind = "kinesthetic",
        origin: Mapping[str, Any] | None = None,
    ) -> Self:
        """Begin a recording, or go on with one that was interrupted.

        Args:
            folder: new or empty, or with a recording that was not stopped.
            setup: says where the cameras and the arm's base are; of every camera, frames are recorded.
            task: for bookkeeping; no policy reads it.
            instructions: the task in words; no policy but the baselines reads them.
            kind: how it is shown.
            origin: what is recorded, as plain values, if it could be told from something else.

        Raises:
            InvalidInput: if the folder holds a recording that was stopped, or of something else or other
                cameras, or cannot be written into.
            CorruptData: if what it holds cannot be read.
        """
        writable_folder(folder, "folder")
        cameras = _cameras(setup)
        if not is_recording(folder):
            if any(folder.iterdir()):
                raise InvalidInput("folder", f"{folder} holds something else", "a new or empty folder")
            words = tuple(instructions)
            recording = RecordedFolder(folder, cameras, (), task, words, kind, origin or {})
            recording.write()
            return cls(setup, recording)
        if (folder / KEYFRAMES).exists():
            problem = f"{folder} holds a recording that has ended"
            raise InvalidInput("folder", problem, "a new folder, or one with an interrupted recording")
        recording = read_folder(folder)
        if set(recording.cameras) != set(cameras):
            problem = f"{folder} holds a recording of cameras {', '.join(recording.cameras)}"
            raise InvalidInput("folder", problem, f"a new folder for cameras {', '.join(cameras)}")
        if dict(recording.origin) != dict(origin or {}):
            problem = f"{folder} holds an interrupted recording of {dict(recording.origin)}"
            raise InvalidInput("folder", problem, f"a new folder for {dict(origin or {})}")
        # A frame that was being written when the recording was interrupted is not continued.
        if (folder / FRAMES).exists():
            os.truncate(folder / FRAMES, len(whole_lines(folder / FRAMES)))
        return cls(setup, recording)

    def add(self, frames: Mapping[str, Frame], state: RobotState) -> None:
        """Append what the cameras saw while the arm was in a state.

        It returns before the images are on disk, but waits if more than `UNWRITTEN` seconds are not.

        Args:
            frames: of all cameras of the set-up, by their names in it.
            state: of the arm, whose stamp is the time of the frame.

        Raises:
            InvalidInput: if a camera is missing or unknown, an image has another size or other intrinsics
                than before, or the stamp is not later than the last one.
            OSError: if the disk is full or gone.
        """
        seen = self._setup.observation(state, frames)
        # Demonstrations call a camera as the set-up says.
        frames = {self._setup.cameras[name].seen_as or name: frame for name, frame in frames.items()}
        if self.last is not None and state.stamp <= self.last:
            accepted = f"seconds, later than the frame before, {self.last:.6f}"
            raise InvalidInput("stamp", f"{state.stamp:.6f}", accepted)
        self._check_intrinsics(frames)
        colors = {name: f"{name}/{self.count:06d}.png" for name in frames}
        depths = {name: f"{name}/{self.count:06d}_depth.png" for name in frames}
        images = [
            job
            for name, frame in frames.items()
            for job in (
                self._pool.submit(write_color, self.folder / colors[name], frame.rgb),
                self._pool.submit(write_depth, self.folder / depths[name], frame.depth),
            )
        ]
        recorded = Recorded(
            state.stamp, seen.T_world_gripper, seen.gripper_opening, state.joint_positions, colors, depths
        )
        self._pending.append(_Pending(recorded, images))
        self.last, self.count = state.stamp, self.count + 1
        self._append(state.stamp - UNWRITTEN)

    def stop(self) -> Draft:
        """Write what is left, find the keyframes and write them, too; nothing can be added afterwards.

        Raises:
            InvalidInput: for fewer than two frames.
        """
        self.close()
        draft = load_draft(self.folder)
        save_draft(draft, self.folder)
        return draft

    def close(self) -> None:
        """Write what is left. The recording can be continued."""
        if self._lines.closed:
            return
        try:
            self._append(np.inf)
        finally:
            self._pool.shutdown()
            self._lines.close()
            self._syncing.ask()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _check_intrinsics(self, frames: Mapping[str, Frame]) -> None:
        """The first frame says the intrinsics, for the driver knows them best."""
        new = {}
        for name, frame in frames.items():
            known = self._intrinsics[name]
            if self.count == 0:
                new[name] = frame.intrinsics
            elif known is None or not np.allclose(known, frame.intrinsics, atol=1e-3):
                accepted = "the same in all frames of a recording"
                raise InvalidInput(f"frames.{name}.intrinsics", f"{frame.intrinsics.tolist()}", accepted)
        if new:
            cameras = {
                name: replace(camera, intrinsics=new[name])
                for name, camera in self._recording.cameras.items()
            }
            self._intrinsics = dict(new)
            self._recording = replace(self._recording, cameras=cameras)
            self._recording.write()

    def _append(self, until: float) -> None:
        """Lines of the frames whose images are on disk, waiting for those up to a stamp."""
        while self._pending:
            first = self._pending[0]
            if first.recorded.stamp > until and not all(job.done() for job in first.images):
                break
            for job in first.images:
                job.result()
            self._lines.write(json.dumps(first.recorded.fields()).encode() + b"\n")
            self._lines.flush()
            self._pending.popleft()
            if self._synced is None or first.recorded.stamp - self._synced > UNWRITTEN:
                self._syncing.ask()
                self._synced = first.recorded.stamp


def _cameras(setup: Setup) -> dict[str, RecordedCamera]:
    return {
        camera.seen_as or name: RecordedCamera(
            camera.intrinsics, DEPTH_STEP, camera.T_world_camera, camera.T_gripper_camera
        )
        for name, camera in setup.cameras.items()
    }
