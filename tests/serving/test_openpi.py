"""`imop serve`, driven by the published openpi-client in an environment of its own: it needs numpy < 2."""

import os
import re
import signal
import struct
import subprocess
import sys
import venv
from contextlib import contextmanager
from pathlib import Path

import pytest

from imop.demos.store import DemonstrationStore
from imop.evaluation.rollout import rollout
from imop.evaluation.trials import Trial, demonstration_for
from imop.serving import schema, wire

# typing_extensions is imported by the client and missing in what it says to need.
PACKAGES = ("openpi-client==0.1.2", "numpy<2", "msgpack", "websockets", "typing_extensions")
LENGTH = struct.Struct("!Q")


@pytest.fixture(scope="module")
def openpi_python(tmp_path_factory):
    """The interpreter of an environment with the published client."""
    folder = tmp_path_factory.mktemp("openpi")
    venv.create(folder, with_pip=False)
    command = [
        sys.executable,
        "-m",
        "pip",
        "--python",
        folder,
        "install",
        "--quiet",
        "--no-deps",
        "--no-compile",
    ]
    options = ["--only-binary", ":all:", "--disable-pip-version-check", "--retries", "1"]
    # What lies in PYTHONPATH would count as installed.
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(
        [*command, *options, *PACKAGES], capture_output=True, text=True, timeout=300, env=environment
    )
    if done.returncode:
        pytest.skip(f"pip cannot install openpi-client: {done.stderr.strip().splitlines()[-1]}")
    return folder / "bin" / "python"


@contextmanager
def imop_serve(*arguments, key):
    """The port of a server that was started by the command; it ends as by Ctrl-C in a terminal."""
    command = [sys.executable, "-m", "imop.cli", "serve", "--port", "0", *map(str, arguments)]
    environment = {**os.environ, "IMOP_API_KEY": key, "PYTHONUNBUFFERED": "1"}
    options = {"stdout": subprocess.PIPE, "text": True, "env": environment, "start_new_session": True}
    with subprocess.Popen(command, **options) as server:
        try:
            found = re.search(r"ws://127\.0\.0\.1:(\d+)", server.stdout.readline())
            assert found, "the server said nothing"
            yield int(found[1])
        finally:
            os.killpg(server.pid, signal.SIGINT)
            said = server.stdout.read()
    assert server.returncode == 0 and "stopped" in said


class Openpi:
    """A policy behind the published client in another process."""

    def __init__(self, python, port, key):
        relay = Path(__file__).with_name("openpi_relay.py")
        self._process = subprocess.Popen(
            [python, "-I", relay, str(port), key], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        self.metadata, self.timings = self._read(), []

    def _read(self):
        head = self._process.stdout.read(LENGTH.size)
        return wire.unpack(self._process.stdout.read(LENGTH.unpack(head)[0]))

    def infer(self, fields):
        message = wire.pack(fields)
        self._process.stdin.write(LENGTH.pack(len(message)) + message)
        self._process.stdin.flush()
        return self._read()

    def watch(self, demonstration):
        raise AssertionError("the server was started with one")

    def reset(self):
        self.infer({"reset": True})

    def act(self, observation):
        reply = self.infer(schema.observation_fields(observation))
        self.timings.append(reply["server_timing"])
        return schema.to_action(reply)

    def close(self):
        self._process.stdin.close()
        assert self._process.wait() == 0


def test_the_published_client_drives_a_whole_task(openpi_python, tmp_path):
    trial = Trial("tabletop/open_drawer", 3)
    shown = demonstration_for(trial)
    DemonstrationStore.create(tmp_path / "shown").append(shown)
    with imop_serve("--demo", tmp_path / "shown", key="secret") as port:
        policy = Openpi(openpi_python, port, "secret")
        assert policy.metadata["server"] == "imop" and policy.metadata["demonstrations"] == 1
        done = rollout(trial.env(), policy, len(shown))
        assert done.success, done.reason
        assert len(policy.timings) == len(done.steps) and all(one["infer_ms"] > 0 for one in policy.timings)
        assert "InvalidInput: views: is missing" in policy.infer({"gripper_opening": 1.0})["error"]
        policy.close()
