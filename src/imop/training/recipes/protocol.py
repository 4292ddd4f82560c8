"""The paper's protocol: networks that saw 100 demonstrations of each base task of RLBench, and nothing else.

imop training protocol --out DIR

What comes of it is reported apart from the bundled weights, which never saw RLBench. The verification, which
the paper does not have, is the bundled one. Run again, it goes on where it was stopped.
"""

from dataclasses import dataclass
from pathlib import Path

from imop.networks.model import BUNDLED
from imop.training.recipes.commands import ROUTING, Stage, quoted


@dataclass(frozen=True)
class ProtocolConfig:
    """How much of everything.

    Attributes:
        out: folder of everything; the weights come directly into it.
        demonstrations: of each base task; three in a row show the same scene's things.
        pairs: of demonstrated steps and other states that call for the same action, at most.
        steps: of 16 pairs, for region and matching.
        routing_steps: of 12 routes.
        jobs: processes that record.
    """

    out: Path
    demonstrations: int = 100
    pairs: int = 12_000
    steps: int = 3000
    routing_steps: int = 700
    jobs: int = 2


def stages(config: ProtocolConfig) -> list[Stage]:
    """The commands: demonstrations, pairs, routes, and the networks."""
    o = quoted(config.out)
    loop = f"-m imop.cli train --out {o}/networks"
    return [
        Stage(
            "demonstrations",
            "demonstrations.json",
            f"-m imop.cli collect --out {o}/demonstrations.zarr --suite rlbench --split base"
            f" --episodes {config.demonstrations} --in-turn --scenes 3 --jobs {config.jobs}",
            codes=(0, 1),  # 1 if the expert gave up some of the scenes; the others will do.
        ),
        Stage(
            "pairs",
            "shards/pairs",
            f"-m imop.cli training recorded --store {o}/demonstrations.zarr --out {o}/shards/pairs"
            f" --pairs {config.pairs} --seed 60",
        ),
        Stage(
            "routes",
            "shards/routes",
            f"-m imop.cli training chains --pairs {o}/shards/pairs --out {o}/shards/routes",
        ),
        Stage(
            "region_and_matching",
            "networks/region_and_matching/card.json",
            f"{loop}/region_and_matching --train {o}/shards/pairs --batch 16 --steps {config.steps}"
            " --learning-rate 0.0013 --seed 70",
        ),
        Stage(
            "routing",
            "networks/routing/card.json",
            f"{loop}/routing --networks routing --routes {o}/shards/routes --batch 12"
            f" --steps {config.routing_steps} {ROUTING} --seed 80",
        ),
        Stage(
            "merged",
            "card.json",
            f"-m imop.cli training merge --out {o} --pairs {o}/networks/region_and_matching"
            f" --routing {o}/networks/routing --verification {quoted(BUNDLED)}",
        ),
    ]
