"""Which demonstrated step a state calls for, on things of families that no training has seen.

The learned router is asked about states of another execution of the demonstrated scene: ordinary ones, in
which the expected step is right (also with the gripper a little elsewhere: `moved`), and ones after a mishap
(a failed grasp, a thing that fell, a joint that moved part of its way, ...). It knows what came before, as in
an episode. The shards hold more mishaps than a rollout: `all` weighs them with `--share`.

    imop training generate --out DIR --routes 200 --seed 77 --held-out
    python benchmarks/routing.py --routes DIR --weights PATH --json FILE
"""

import json
import shlex
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
import tyro
from rich.console import Console
from rich.table import Table

from imop.evaluation.report import console_for_tables
from imop.evaluation.statistics import wilson
from imop.networks.model import BUNDLED, Model, load_model
from imop.policy.router import Odds, prior
from imop.training.data.route import Route
from imop.training.data.route_batch import make_route_sample
from imop.training.data.route_shards import RouteShard


@dataclass
class Options:
    """Settings of the benchmark.

    Attributes:
        routes: folder of shards of routes of held-out families.
        weights: of the routing network.
        share: of states after a mishap among those of a rollout.
        json: where the results go.
    """

    routes: Path
    weights: Path = BUNDLED
    share: float = 0.1
    json: Path | None = None


@dataclass(frozen=True)
class Row:
    """One state: what led to it, whether the expected step is right there, and whether the chosen one is."""

    kind: str
    ordinary: bool
    network: bool
    router: bool


def rows(model: Model, route: Route) -> Iterator[Row]:
    sample = make_route_sample(route, model.config.route_graph)
    steps = len(route.states)
    one = torch.zeros(steps + len(route.queries), dtype=torch.int64)
    with torch.inference_mode():
        asked = one[: len(route.queries)]
        scores, _ = model.routing(sample.shown, one[:steps], sample.query, asked, sample.expected)
    for query, seen in zip(route.queries, scores.double().numpy(), strict=True):
        weighed = seen + np.log(prior(Odds(), query.expected, steps))
        right = query.right
        ordinary = query.expected < steps and bool(right[query.expected])
        yield Row(query.kind, ordinary, bool(right[seen.argmax()]), bool(right[weighed.argmax()]))


def accuracy(found: list[Row], share: float) -> dict[str, dict]:
    """Rows of the table: number, share right with its interval, and that of the network by itself."""
    groups = {
        "ordinary": [row for row in found if row.ordinary],
        "after a mishap": [row for row in found if not row.ordinary],
    }
    for kind in sorted({row.kind for row in found} - {"ordinary"}):
        groups[kind] = [row for row in found if row.kind == kind]
    table = {name: counted(group) for name, group in groups.items()}
    parts = ((1 - share, table["ordinary"]), (share, table["after a mishap"]))
    mean = {key: sum(weight * part[key] for weight, part in parts) for key in ("router", "network")}
    # Half widths of independent parts add in squares.
    low, high = (
        float(np.hypot(*(weight * (part["interval"][side] - part["router"]) for weight, part in parts)))
        for side in (0, 1)
    )
    interval = (mean["router"] - low, min(mean["router"] + high, 1.0))
    return {"all": {"n": len(found), **mean, "interval": interval}, **table}


def counted(group: list[Row]) -> dict:
    right = sum(row.router for row in group)
    network = float(np.mean([row.network for row in group]))
    return {
        "n": len(group),
        "router": right / len(group),
        "network": network,
        "interval": wilson(right, len(group)),
    }


def show(table: dict[str, dict], share: float, console: Console) -> None:
    shown = Table(
        title=f"routing on held-out families; all: {100 * share:.0f} % of the states after a mishap"
    )
    for name in ("states", "n", "router", "network alone"):
        shown.add_column(name, justify="left" if name == "states" else "right")
    for name, row in table.items():
        low, high = row["interval"]
        right = f"{100 * row['router']:.1f} % ({100 * low:.1f}-{100 * high:.1f})"
        shown.add_row(name, str(row["n"]), right, f"{100 * row['network']:.1f} %")
    console.print(shown)


def main() -> int:
    options = tyro.cli(Options, description=__doc__)
    torch.set_num_threads(1)
    model = load_model(options.weights)
    shards = [RouteShard(path) for path in sorted(options.routes.glob("*.npz"))]
    found = [row for shard in shards for i in range(len(shard)) for row in rows(model, shard[i])]
    table = accuracy(found, options.share)
    console = console_for_tables()
    show(table, options.share, console)
    if options.json:
        report = {
            "rows": table,
            "share": options.share,
            "routes": sum(map(len, shards)),
            "command": shlex.join(["python", *sys.argv]),
        }
        options.json.write_text(json.dumps(report, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
