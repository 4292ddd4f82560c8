"""From nothing to weights: `imop train --recipe small --out DIR` runs one command after the other.

Run again, what is done is skipped, and the stage that was stopped goes on as its command does.
"""

import json
import shlex
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

from rich.console import Console

from imop.errors import InvalidInput
from imop.files import replaced
from imop.training.ablation import Ablation
from imop.training.config import TrainConfig
from imop.training.recipes.commands import ROUTING, Stage, quoted, run

# What is slow to import is imported where it is needed, for the command line names the recipes.

RecipeName = Literal["small", "trial"]


@dataclass(frozen=True)
class Recipe:
    """How much of everything.

    Attributes:
        pairs: synthetic pairs of all training families and kinds of goals.
        mix: shares of pairs and cases with the same things, others in colour, in shape, in both.
        validation: pairs of the same families for the validation.
        routes: synthetic routes.
        validation_routes: routes for the validation.
        tasks: of the suite's split base that are recorded; all if none.
        demonstrations: of each variation of these tasks; three in a row show the same objects.
        recorded: pairs from the demonstrations, at most.
        others: share of these pairs, and of the cases of demonstrations, with other objects.
        shares: how often training draws a synthetic and a recorded pair.
        batch: pairs per step, of all processes together.
        steps: of region and matching.
        routing_batch: routes per step, of all processes together.
        routing_steps: of the routing network.
        every: steps between validations and checkpoints.
        first_cases: cases that are searched with an untrained verification, for a first one.
        cases: cases that are searched with the first verification.
        recorded_cases: the same of the demonstrations, at most.
        verification_steps: of each verification.
    """

    pairs: int
    mix: tuple[float, float, float, float]
    validation: int
    routes: int
    validation_routes: int
    tasks: tuple[str, ...]
    demonstrations: int
    recorded: int
    others: float
    shares: tuple[float, float]
    batch: int
    steps: int
    routing_batch: int
    routing_steps: int
    every: int
    first_cases: int
    cases: int
    recorded_cases: int
    verification_steps: int


RECIPES: dict[RecipeName, Recipe] = {
    "small": Recipe(
        pairs=30_000,
        mix=(0.35, 0.1, 0.25, 0.3),
        validation=300,
        routes=400,
        validation_routes=60,
        tasks=(),
        demonstrations=6,
        recorded=4_000,
        others=0.8,
        shares=(0.9, 0.1),
        batch=16,
        steps=10_000,
        routing_batch=12,
        routing_steps=700,
        every=250,
        first_cases=400,
        cases=3_600,
        recorded_cases=1_200,
        verification_steps=4_000,
    ),
    "trial": Recipe(
        pairs=4,
        mix=(0.35, 0.1, 0.25, 0.3),
        validation=2,
        routes=2,
        validation_routes=1,
        tasks=("open_drawer",),
        demonstrations=6,
        recorded=4,
        others=0.8,
        shares=(0.9, 0.1),
        batch=2,
        steps=2,
        routing_batch=2,
        routing_steps=2,
        every=2,
        first_cases=2,
        cases=2,
        recorded_cases=2,
        verification_steps=20,
    ),
}
"""small makes weights like the bundled ones; trial tells in minutes whether every stage runs here."""


def stages(recipe: Recipe, out: Path, jobs: int) -> list[Stage]:
    """The commands in their order, each that draws at random with a seed of its own.

    Args:
        recipe: how much of everything.
        out: folder of everything; the weights come directly into it.
        jobs: processes. Shards, demonstrations and cases do not depend on them.
    """
    r, o = recipe, quoted(out)
    mix, shares = (" ".join(map(str, numbers)) for numbers in (r.mix, r.shares))
    tasks = f" --tasks {shlex.join(r.tasks)}" if r.tasks else ""
    generate = f"-m imop.cli training generate --jobs {jobs} --out {o}/shards"
    search = f"-m imop.cli training cases --jobs {jobs} --mix {mix} --out {o}/cases"
    verify = f"-m imop.cli training verification --steps {r.verification_steps} --weights {o}/networks/merged"
    return [
        Stage("pairs", "shards/pairs", f"{generate}/pairs --pairs {r.pairs} --mix {mix} --seed 10"),
        Stage(
            "validation",
            "shards/validation",
            f"{generate}/validation --pairs {r.validation} --mix {mix} --seed 20",
        ),
        Stage("routes", "shards/routes", f"{generate}/routes --routes {r.routes} --seed 30"),
        Stage(
            "validation_routes",
            "shards/validation_routes",
            f"{generate}/validation_routes --routes {r.validation_routes} --seed 40",
        ),
        Stage(
            "demonstrations",
            "demonstrations.json",
            f"-m imop.cli collect --out {o}/demonstrations.zarr --split base{tasks}"
            f" --episodes {r.demonstrations} --scenes 3 --seed 50 --jobs {jobs}",
            codes=(0, 1),  # 1 if the expert gave up some of the scenes; the others will do.
        ),
        Stage(
            "recorded",
            "shards/recorded",
            f"-m imop.cli training recorded --store {o}/demonstrations.zarr --out {o}/shards/recorded"
            f" --pairs {r.recorded} --others {r.others} --seed 60",
        ),
        Stage(
            "region_and_matching",
            "networks/region_and_matching/card.json",
            f"{_loop(r.batch, jobs)} --out {o}/networks/region_and_matching"
            f" --train {o}/shards/pairs {o}/shards/recorded --shares {shares}"
            f" --validate {o}/shards/validation --validation-pairs {r.validation}"
            f" --steps {r.steps} --every {r.every} --learning-rate 0.0013 --seed 70",
        ),
        Stage(
            "routing",
            "networks/routing/card.json",
            f"{_loop(r.routing_batch, jobs)} --out {o}/networks/routing --networks routing"
            f" --routes {o}/shards/routes --validate-routes {o}/shards/validation_routes"
            f" --steps {r.routing_steps} --every {r.every} {ROUTING} --seed 80",
        ),
        Stage(
            "merged",
            "networks/merged/card.json",
            f"-m imop.cli training merge --out {o}/networks/merged --pairs {o}/networks/region_and_matching"
            f" --routing {o}/networks/routing",
        ),
        # A verification ends the search, so the cases of an untrained one are not what it will see later.
        Stage(
            "first_cases",
            "cases/first",
            f"{search}/first --cases {r.first_cases} --weights {o}/networks/merged --seed 90",
        ),
        Stage(
            "first_verification",
            "networks/first/card.json",
            f"{verify} --cases {o}/cases/first --out {o}/networks/first --seed 100",
        ),
        Stage(
            "cases",
            "cases/second",
            f"{search}/second --cases {r.cases} --weights {o}/networks/first --seed 110",
        ),
        Stage(
            "recorded_cases",
            "cases/recorded",
            f"{search}/recorded --cases {r.recorded_cases} --weights {o}/networks/first --seed 130"
            f" --store {o}/demonstrations.zarr --others {r.others}",
        ),
        Stage(
            "verification",
            "card.json",
            f"{verify} --cases {o}/cases/first {o}/cases/second {o}/cases/recorded --out {o} --seed 120",
        ),
    ]


def _loop(batch: int, jobs: int) -> str:
    """The training on as many processes as can share the batch; every step has the same samples on any."""
    import torch

    most = torch.cuda.device_count() or jobs
    processes = max(n for n in range(1, most + 1) if batch % n == 0)
    torchrun = f"-m torch.distributed.run --standalone --nproc-per-node {processes}"
    return f"{torchrun} -m imop.cli train --batch {batch // processes}"


def make(name: RecipeName, out: Path, jobs: int, console: Console) -> None:
    """Run every stage that is not done yet, then write into the card how the weights were made.

    Args:
        name: which recipe.
        out: folder of everything; one in which the same recipe was stopped is continued.
        jobs: processes.
        console: for a few lines per stage.

    Raises:
        InvalidInput: for less than one process, or a folder of another recipe.
        StageFailed: if a command fails.
    """
    if jobs < 1:
        raise InvalidInput("jobs", f"{jobs}", "a number of processes from 1 on")
    _claim(RECIPES[name], out)
    every = stages(RECIPES[name], out, jobs)
    run(every, out, console)
    _complete_card(name, every, out)


def _claim(recipe: Recipe, out: Path) -> None:
    """What another recipe made would count as done, so a folder belongs to one."""
    file, wanted = out / "recipe.json", json.dumps(asdict(recipe), indent=2).encode()
    if file.exists() and file.read_bytes() != wanted:
        raise InvalidInput("out", f"{out} was begun by another recipe ({file})", "another folder")
    with replaced(file) as temporary:
        temporary.write_bytes(wanted)


def _complete_card(name: RecipeName, every: Sequence[Stage], out: Path) -> None:
    """Add to the weights' card: recipe, commands as they ran, and how much there is of everything."""
    from imop.training.data.route_shards import RouteShard
    from imop.training.data.shards import Shard

    card: dict[str, Any] = json.loads((out / "card.json").read_text())
    counts = {}
    for folder in sorted((out / "shards").iterdir()):
        kind = RouteShard if "routes" in folder.name else Shard
        counts[folder.name] = sum(len(kind(path)) for path in folder.glob("*.npz"))
    demonstrations = json.loads((out / "demonstrations.json").read_text())
    card |= {
        "recipe": name,
        "commands": {s.name: json.loads(s.record(out).read_text())["command"] for s in every},
        "counts": {**counts, "demonstrations": demonstrations["episodes"]},
        "licence": "MIT",
    }
    with replaced(out / "card.json") as temporary:
        temporary.write_text(json.dumps(card, indent=2) + "\n")


def refuse_others(config: TrainConfig, ablation: Ablation, size: str) -> None:
    """A recipe decides everything but the folder and the number of processes.

    Raises:
        InvalidInput: if an option of another training does not have its default.
    """
    usual = {**asdict(TrainConfig(config.out)), **asdict(Ablation()), "size": "small"}
    given = {**asdict(config), **asdict(ablation), "size": size}
    if others := [field for field, value in given.items() if value != usual[field]]:
        raise InvalidInput(others[0], "does not go together with --recipe", "--out and --jobs alone")
