"""Stages of long work: commands that anybody can run by hand, too, one after the other until all are done."""

import json
import os
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from imop.errors import StageFailed
from imop.files import replaced

ROUTING = "--learning-rate 0.002 --weight-decay 0.05 --ema 0.98 --precision float32"
"""Options with which the routing network is trained, wherever it is."""


@dataclass(frozen=True)
class Stage:
    """One command.

    Attributes:
        name: of its log and of the record that it was done.
        makes: the file or folder that is there when it was done, within that of the recipe.
        command: as it is typed after `python`.
        codes: exit codes that mean that it was done.
    """

    name: str
    makes: str
    command: str
    codes: tuple[int, ...] = (0,)

    def done(self, out: Path) -> bool:
        """Whether its command has ended well and what it made is there."""
        return self.record(out).is_file() and (out / self.makes).exists()

    def record(self, out: Path) -> Path:
        """The file that says that its command has ended well."""
        return out / "stages" / f"{self.name}.json"

    def log(self, out: Path) -> Path:
        """The file with what its command says."""
        return out / "stages" / f"{self.name}.log"


def quoted(path: Path) -> str:
    """A path as it is typed in a command."""
    return shlex.quote(str(path))


def run(every: Sequence[Stage], out: Path, console: Console) -> None:
    """Run the stages that are not done, one after the other.

    What stops this process (Ctrl-C, SIGTERM, a closed terminal) stops the command as well, which would be
    started a second time otherwise.

    Raises:
        StageFailed: if a command ends with another exit code than it should, or without what it makes.
    """
    for stop in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(stop) == signal.SIG_DFL:  # nohup ignores the latter
            signal.signal(stop, signal.default_int_handler)
    for number, stage in enumerate(every, start=1):
        title = f"{number}/{len(every)} {stage.name}"
        if stage.done(out):
            console.print(f"{title}: done before", soft_wrap=True)
            continue
        console.print(f"{title}: python {stage.command} > {stage.log(out)}", soft_wrap=True)
        started = time.monotonic()
        _perform(stage, out)
        console.print(f"{title}: done after {time.monotonic() - started:.0f} s", soft_wrap=True)


def _perform(stage: Stage, out: Path) -> None:
    log, record = stage.log(out), stage.record(out)
    log.parent.mkdir(parents=True, exist_ok=True)
    record.unlink(missing_ok=True)
    # One thread per process: cores are better spent on processes.
    environment = {"OMP_NUM_THREADS": "1", **os.environ}
    with log.open("ab") as said:
        command = [sys.executable, *shlex.split(stage.command)]
        process = subprocess.Popen(
            command, stdout=said, stderr=subprocess.STDOUT, env=environment, start_new_session=True
        )
        try:
            code = process.wait()
        except BaseException:
            os.killpg(process.pid, signal.SIGTERM)  # with the processes that it has started
            process.wait()
            raise
    if code not in stage.codes or not (out / stage.makes).exists():
        raise StageFailed(stage.name, code, log)
    with replaced(record) as temporary:
        temporary.write_text(json.dumps({"command": f"python {stage.command}", "code": code}) + "\n")
