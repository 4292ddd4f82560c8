"""Synthetic pairs per second on this machine: made, and trained on.

python benchmarks/training.py --json training.json

The rate of training is the difference between a long and a short run, so that starting up does not count.
A product of matrices is timed before and after: if the two differ, the machine was busy.
"""

import json
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import torch
import tyro
from rich.console import Console
from rich.table import Table

from imop.training.synthetic.generate import GenerateConfig, generate

LIMIT = 4.0
"""What issue 4 asks for: pairs per second for `small` on two cores."""


@dataclass
class Arguments:
    """How much to measure, and where to write it."""

    json: Path | None = None
    """File for the results."""
    shards: Path | None = None
    """Folder of shards to train on; pairs are made if not given."""
    pairs: int = 60
    """How many are made."""
    steps: tuple[int, int] = (5, 45)
    """Steps of the short and of the long run."""
    batch: int = 8
    """Pairs per step and process."""
    processes: int = 2
    """That train together; on CPUs one per core is twice as fast as one with as many threads."""
    workers: int = 1
    """Processes that prepare samples beside each that trains."""


def reference(seconds: float = 2.0, size: int = 1024) -> float:
    """Billions of float32 operations per second in products of matrices."""
    a = torch.rand(size, size)
    done, start = 0, time.perf_counter()
    while time.perf_counter() - start < seconds:
        a @ a
        done += 1
    return 2e-9 * size**3 * done / (time.perf_counter() - start)


def making(folder: Path, pairs: int) -> float:
    """Pairs per second and core."""
    start = time.perf_counter()
    generate(GenerateConfig(folder, pairs))
    return pairs / (time.perf_counter() - start)


def training(shards: Path, arguments: Arguments) -> float:
    """Pairs per second."""
    together = ["-m", "torch.distributed.run", "--standalone", "--nproc-per-node", str(arguments.processes)]
    seconds = []
    for steps in arguments.steps:
        with tempfile.TemporaryDirectory() as out:
            asked = {"steps": steps, "batch": arguments.batch, "workers": arguments.workers}
            options = [text for name, value in asked.items() for text in (f"--{name}", str(value))]
            loop = ["-m", "imop.training.loop.train", "--out", out, "--train", str(shards), *options]
            start = time.perf_counter()
            subprocess.run([sys.executable, *together, *loop], check=True, capture_output=True)
            seconds.append(time.perf_counter() - start)
    short, long = arguments.steps
    return (long - short) * arguments.batch * arguments.processes / (seconds[1] - seconds[0])


def main(arguments: Arguments) -> None:
    """Measure and print."""
    results: dict[str, float] = {"threads": torch.get_num_threads(), "reference_before": reference()}
    with tempfile.TemporaryDirectory() as made:
        shards = arguments.shards
        if shards is None:
            shards = Path(made)
            results["made_per_s_and_core"] = making(shards, arguments.pairs)
        results["trained_per_s"] = training(shards, arguments)
    results["reference_after"] = reference()
    table = Table("what", "measured", "needed")
    for name, value in results.items():
        table.add_row(name, f"{value:.2f}", f"{LIMIT:.0f}" if name == "trained_per_s" else "")
    Console().print(table)
    if arguments.json is not None:
        arguments.json.write_text(json.dumps(results, indent=2) + "\n")


if __name__ == "__main__":
    main(tyro.cli(Arguments, description=__doc__))
