"""Stages run in their order until all are done, however often they are stopped."""

import json
import os
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from rich.console import Console

from imop.errors import StageFailed
from imop.training.recipes.commands import Stage, run


def stub(out, name, code, **more):
    """A stage that writes down that it began and then does what `code` says, in the folder `out`."""
    begun = f"import os; os.chdir({str(out)!r}); open('order', 'a').write({name + ' '!r}); "
    return Stage(name, f"made-{name}", f"-c {shlex.quote(begun + code)}", **more)


def touching(out, name, **more):
    return stub(out, name, f"open('made-{name}', 'w'); print('here is {name}')", **more)


def order(out):
    return (out / "order").read_text().split()


def quietly(every, out):
    run(every, out, Console(quiet=True))


def test_in_order_with_a_log_and_a_record_each(tmp_path):
    every = [touching(tmp_path, name) for name in ("b", "a", "c")]
    quietly(every, tmp_path)
    assert order(tmp_path) == ["b", "a", "c"]
    for stage in every:
        assert stage.log(tmp_path).read_text() == f"here is {stage.name}\n"
        assert json.loads(stage.record(tmp_path).read_text())["command"] == f"python {stage.command}"


def test_what_is_done_is_skipped_unless_what_it_made_is_gone(tmp_path):
    every = [touching(tmp_path, name) for name in ("a", "b")]
    quietly(every, tmp_path)
    quietly(every, tmp_path)
    assert order(tmp_path) == ["a", "b"]
    (tmp_path / "made-b").unlink()
    quietly(every, tmp_path)
    assert order(tmp_path) == ["a", "b", "b"]


def test_a_failure_names_stage_and_log_and_the_next_run_goes_on_there(tmp_path):
    failing = stub(tmp_path, "b", "open('made-b', 'w'); raise SystemExit('no luck')")
    with pytest.raises(StageFailed) as caught:
        quietly([touching(tmp_path, "a"), failing, touching(tmp_path, "c")], tmp_path)
    assert (caught.value.stage, caught.value.code) == ("b", 1)
    assert str(caught.value.log) in str(caught.value) and "no luck" in caught.value.log.read_text()
    assert order(tmp_path) == ["a", "b"]
    quietly([touching(tmp_path, name) for name in "abc"], tmp_path)
    assert order(tmp_path) == ["a", "b", "b", "c"]
    assert "no luck" in caught.value.log.read_text(), "what was said before stays"


def test_who_ends_well_without_a_result_has_failed(tmp_path):
    with pytest.raises(StageFailed, match="lazy"):
        quietly([stub(tmp_path, "lazy", "pass")], tmp_path)


def test_an_exit_code_may_be_fine(tmp_path):
    code = "open('made-a', 'w'); raise SystemExit(1)"
    quietly([stub(tmp_path, "a", code, codes=(0, 1))], tmp_path)
    with pytest.raises(StageFailed):
        quietly([stub(tmp_path, "a", code.replace("1", "2"), codes=(0, 1))], tmp_path / "other")


CHILD = """
import os, time
open("begun", "w").write(str(os.getpid()))
os.rename("begun", "pid")
time.sleep(600)
"""
STAGES = """
import signal
# A shell has what it runs in the background ignore interrupts, and so would this.
signal.signal(signal.SIGINT, signal.default_int_handler)
import sys
from pathlib import Path
from rich.console import Console
from imop.training.recipes.commands import Stage, run
run([Stage("long", "made-long", sys.argv[1])], Path(sys.argv[2]), Console(quiet=True))
"""


@pytest.mark.parametrize("stop", [signal.SIGINT, signal.SIGTERM])
def test_who_stops_the_stages_stops_the_command_and_its_processes(tmp_path, stop):
    stage = stub(
        tmp_path, "long", f"import subprocess, sys; subprocess.run([sys.executable, '-c', {CHILD!r}])"
    )
    arguments = [sys.executable, "-c", STAGES, stage.command, str(tmp_path)]
    process = subprocess.Popen(arguments, stderr=subprocess.DEVNULL)
    assert soon((tmp_path / "pid").is_file)
    process.send_signal(stop)
    assert process.wait(timeout=60) != 0
    pid = int((tmp_path / "pid").read_text())
    assert soon(lambda: not runs(pid)), "the command's own process goes on"
    assert not stage.done(tmp_path)


def soon(what, seconds=60):
    """What it returns once that is true."""
    end = time.monotonic() + seconds
    while not (found := what()) and time.monotonic() < end:
        time.sleep(0.05)
    return found


def runs(pid):
    """Whether the process does anything; what nobody has waited for yet does not."""
    try:
        os.kill(pid, 0)
        status = Path(f"/proc/{pid}/stat")
        return not (status.exists() and status.read_text().rsplit(")", 1)[1].split()[0] == "Z")
    except (ProcessLookupError, FileNotFoundError):
        return False
