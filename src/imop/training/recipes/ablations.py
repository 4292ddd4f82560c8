"""Every row of the paper's table of ablations, trained equally.

imop training ablations --out DIR --train PAIRS --routes ROUTES --validate PAIRS

Each row becomes a folder of weights with which `imop eval --methods paper --weights DIR/ROW` runs. All rows
see the same pairs in the same order, for as many steps. Run again, it goes on where it was stopped.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from imop.networks.model import BUNDLED
from imop.training.recipes.commands import ROUTING, Stage, quoted

Row = Literal[
    "small",
    "no_low_dimensional",
    "graph_attention",
    "no_region",
    "k4",
    "k16",
    "from_matches",
    "regressed",
]

ROWS: dict[Row, str] = {
    "small": "",
    "no_low_dimensional": "--no-low-dimensional",
    "graph_attention": "--attention graph",
    "no_region": "--no-region-first --networks matching",
    "k4": "--neighbours 4",
    "k16": "--neighbours 16",
    "from_matches": "--pose from_matches --networks region matching pose",
    "regressed": "--pose regressed --networks pose",
}
"""Name -> options of `imop train`. `small` has global attention and K = 8."""


@dataclass(frozen=True)
class AblationsConfig:
    """How the rows are trained.

    Attributes:
        out: folder of everything; each row is a folder in it.
        train: folders of shards of pairs.
        routes: folders of shards of routes.
        validate: folders of shards that no row is trained on.
        shares: how often each folder of pairs is drawn from; equally if none are given.
        rows: only these, names of `ROWS`; all if none is given.
        steps: of 16 pairs, for each row.
        routing_steps: of 12 routes, for the routing network with and without the robot's state.
        seed: of weights, data and augmentation, the same for all rows.
    """

    out: Path
    train: tuple[Path, ...]
    routes: tuple[Path, ...]
    validate: tuple[Path, ...]
    shares: tuple[float, ...] = ()
    rows: tuple[Row, ...] = ()
    steps: int = 1500
    routing_steps: int = 700
    seed: int = 0


def stages(config: AblationsConfig) -> list[Stage]:
    """The commands: two routing networks, then for each row its training and the merge."""
    routing = {"routing": "", "routing_no_low_dimensional": ROWS["no_low_dimensional"]}
    found = [_routing(config, name, options) for name, options in routing.items()]
    for name in config.rows or ROWS:
        found += _row(config, name)
    return found


def _routing(config: AblationsConfig, name: str, options: str) -> Stage:
    command = (
        f"{_train(config, name)} --networks routing --routes {_paths(config.routes)} {options}"
        f" --batch 12 --steps {config.routing_steps} --every {config.routing_steps}"
        f" {ROUTING}"
    )
    return Stage(name, f"networks/{name}/card.json", command)


def _row(config: AblationsConfig, name: Row) -> list[Stage]:
    shares = f" --shares {' '.join(map(str, config.shares))}" if config.shares else ""
    blind = "_no_low_dimensional" if name == "no_low_dimensional" else ""
    networks, out = f"{quoted(config.out)}/networks", quoted(config.out)
    trained = (
        f"{_train(config, name)} --train {_paths(config.train)}{shares} --validate {_paths(config.validate)}"
        f" --batch 16 --steps {config.steps} --learning-rate 0.0013 {ROWS[name]}"
    )
    merged = (
        f"-m imop.cli training merge --out {out}/{name} --pairs {networks}/{name}"
        f" --routing {networks}/routing{blind} --verification {quoted(BUNDLED)}"
    )
    return [
        Stage(f"{name}_networks", f"networks/{name}/card.json", trained),
        Stage(name, f"{name}/card.json", merged),
    ]


def _train(config: AblationsConfig, name: str) -> str:
    return f"-m imop.cli train --out {quoted(config.out)}/networks/{name} --seed {config.seed}"


def _paths(folders: tuple[Path, ...]) -> str:
    return " ".join(map(quoted, folders))
