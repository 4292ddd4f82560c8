"""What `imop serve` adds to a decision, and whether its memory is steady.

    python benchmarks/serving.py --json FILE
    python benchmarks/serving.py --larger 5 --method benchmarks.serving:Idle --json FILE
    python benchmarks/serving.py --requests 1000 --json FILE

The same policy is asked in this process and through the server for the same recorded states, one after the
other, so that the ratio depends little on what else the machine does. The second line is about transport
alone: a policy that does nothing gets images of 640 x 640 instead of the simulation's 128 x 128, from four
cameras. With `--requests` the server alone is asked so often, in episodes one after the other, and the memory
of all its processes is read in between.
"""

import json
import re
import shlex
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from itertools import cycle, islice
from pathlib import Path

import numpy as np
import tyro
from rich.console import Console

from imop.demos.store import DemonstrationStore
from imop.evaluation.methods import Policy, make_policy
from imop.files import replaced
from imop.serving import Client
from imop.tasks.env import make_task
from imop.tasks.expert import record_demonstration
from imop.types import Action, CameraView, Demonstration, Observation


@dataclass
class Options:
    """Settings of the benchmark.

    Attributes:
        task: a base task.
        method: what is served.
        seeds: scenes after the demonstrated one.
        larger: how many times wider and higher images are than the simulation's.
        requests: read the memory while so many are answered, instead of the times.
        json: where the results go.
    """

    task: str = "tabletop/open_drawer"
    method: str = "learned"
    seeds: int = 5
    larger: int = 1
    requests: int = 0
    json: Path | None = None


class Idle:
    """Decides in no time."""

    def watch(self, demonstration: Demonstration) -> None:
        """Nothing is remembered."""

    def reset(self) -> None:
        """Nothing was."""

    def act(self, observation: Observation) -> Action:
        """Stay there."""
        return Action(observation.T_world_gripper, True)


def enlarged(view: CameraView, times: int) -> CameraView:
    rgb, depth = (np.repeat(np.repeat(image, times, 0), times, 1) for image in (view.rgb, view.depth))
    # The centre of a pixel becomes the centre of its square.
    K = view.intrinsics.copy()
    K[:2] *= times
    K[:2, 2] += (times - 1) / 2
    return CameraView(rgb, depth, K, view.T_world_camera)


def recorded(options: Options, seed: int) -> Demonstration:
    shown = record_demonstration(make_task(options.task), seed, instance_seed=0).stripped()

    def larger(observation: Observation) -> Observation:
        views = {name: enlarged(view, options.larger) for name, view in observation.views.items()}
        return replace(observation, views=views)

    keyframes = tuple(replace(k, observation=larger(k.observation)) for k in shown.keyframes)
    return replace(shown, keyframes=keyframes, final=larger(shown.final))


@contextmanager
def serving(options: Options, shown: Demonstration) -> Iterator[tuple[int, int]]:
    """The process and the port of a server that knows the demonstration."""
    with tempfile.TemporaryDirectory() as folder:
        store = DemonstrationStore.create(Path(folder) / "shown")
        store.append(shown)
        command = [sys.executable, "-u", "-m", "imop.cli", "serve", "--demo", str(store.path)]
        command += ["--method", options.method, "--port", "0", "--request-seconds", "3600"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
            assert server.stdout is not None
            port = re.search(r":(\d+)$", server.stdout.readline().strip())
            try:
                assert port, "the server did not start"
                yield server.pid, int(port[1])
            finally:
                server.send_signal(signal.SIGINT)


def episodes(options: Options) -> list[list[Observation]]:
    seeds = range(1, options.seeds + 1)
    return [[step.observation for step in recorded(options, seed).keyframes] for seed in seeds]


def decide(policy: Policy, observation: Observation) -> float:
    started = time.perf_counter()
    policy.act(observation)
    return 1000 * (time.perf_counter() - started)


def times(options: Options, console: Console) -> dict[str, object]:
    """Milliseconds of every decision, here and served."""
    shown = recorded(options, 0)
    here = make_policy(options.method)
    here.watch(shown)
    rows = []
    with serving(options, shown) as (_, port), Client(port=port) as there:
        for k, episode in enumerate(episodes(options)):
            policies: list[tuple[str, Policy]] = [("here", here), ("served", there)]
            for observation in episode:
                policies.reverse()
                taken = {}
                for name, policy in policies:
                    if observation is episode[0]:
                        policy.reset()
                    taken[name] = decide(policy, observation)
                # The first request of a connection starts its process, and all that is new is slow once.
                if k:
                    rows.append({**taken, "infer": there.timing["infer_ms"]})
    here_ms, served_ms, infer_ms = (np.array([row[n] for row in rows]) for n in ("here", "served", "infer"))
    found = {
        "decisions": len(rows),
        "here_ms": float(np.median(here_ms)),
        "served_ms": float(np.median(served_ms)),
        "ratio_of_sums": float(served_ms.sum() / here_ms.sum()),
        "median_ratio": float(np.median(served_ms / here_ms)),
        # What of the server's time is not the policy's, measured within each request.
        "around_ms": float(np.median(served_ms - infer_ms)),
        "served_by_infer": float(served_ms.sum() / infer_ms.sum()),
    }
    console.print(found)
    return {**found, "rows": rows}


def family(pid: int) -> list[int]:
    """A process and all that descend from it."""
    parents = {}
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            parents[int(status.parent.name)] = int(status.read_text().rpartition(")")[2].split()[1])
        except OSError:
            continue
    found = [pid]
    for one in found:
        found += [child for child, parent in parents.items() if parent == one]
    return found


def memory(pid: int) -> float:
    """MiB of all processes of a server; what several share counts once."""
    total = 0
    for one in family(pid):
        # It may have ended since.
        with suppress(OSError):
            lines = Path(f"/proc/{one}/smaps_rollup").read_text().splitlines()
            total += sum(int(line.split()[1]) for line in lines if line.startswith("Pss:"))
    return total / 1024


def memories(options: Options, console: Console) -> dict[str, object]:
    """Memory after every twentieth of the requests."""
    shown, rows = recorded(options, 0), []
    every = max(options.requests // 20, 1)
    with serving(options, shown) as (pid, port), Client(port=port) as client:
        asked = [(k == 0, step) for episode in episodes(options) for k, step in enumerate(episode)]
        for number, (first, observation) in enumerate(islice(cycle(asked), options.requests), start=1):
            if first:
                client.reset()
            client.act(observation)
            if number % every == 0:
                rows.append({"requests": number, "MiB": round(memory(pid), 1)})
                console.print(rows[-1])
    return {"memory": rows}


def main() -> int:
    options = tyro.cli(Options, description=__doc__)
    console = Console()
    found = memories(options, console) if options.requests else times(options, console)
    if options.json:
        with replaced(options.json) as temporary:
            report = {**found, "command": shlex.join(["python", *sys.argv])}
            temporary.write_text(json.dumps(report, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
