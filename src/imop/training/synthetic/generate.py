"""Writes shards of synthetic pairs or routes; run again, it goes on."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed

from imop.errors import CorruptData, InvalidInput
from imop.training.data.route_shards import ROUTE_SHARD, RouteShard, write_routes
from imop.training.data.shards import SHARD, Shard, write_shard
from imop.training.synthetic.families import HELD_OUT, TRAINING, Family
from imop.training.synthetic.instances import shares
from imop.training.synthetic.pairs import SAME_ONLY, synthetic_pairs
from imop.training.synthetic.plans import check_kinds
from imop.training.synthetic.routes import synthetic_routes


@dataclass(frozen=True)
class GenerateConfig:
    """What is generated: pairs, or routes.

    Attributes:
        out: folder of the shards; whole ones that are there stay.
        pairs: number of pairs, for the region and matching networks.
        routes: number of routes, for the routing network.
        seed: with a shard's number and size it determines the content.
        jobs: worker processes.
        held_out: whether the scenes are made of the families that are for testing only.
        families: that the scenes are made of; all if none is named.
        mix: shares of pairs whose query shows the same things, others in colour, in shape, in both.
        kinds: of what is done in pairs (`plans.SHARES`); all if none is named.
    """

    out: Path
    pairs: int | None = None
    routes: int | None = None
    seed: int = 0
    jobs: int = 1
    held_out: bool = False
    families: tuple[str, ...] = ()
    mix: tuple[float, float, float, float] = SAME_ONLY
    kinds: tuple[str, ...] = ()


def generate(config: GenerateConfig) -> None:
    """Write numbered shards of pairs or routes.

    Raises:
        InvalidInput: if neither or both are asked for, there is no such family or kind, or the mix is none.
    """
    families = chosen(config.families, config.held_out)
    check_kinds(config.kinds)
    shares(config.mix)
    count = config.pairs if config.routes is None else config.routes
    if count is None or (config.pairs is not None and config.routes is not None):
        raise InvalidInput("pairs", f"{config.pairs} with routes {config.routes}", "one of the two")
    config.out.mkdir(parents=True, exist_ok=True)
    full = SHARD if config.routes is None else ROUTE_SHARD
    sizes = [min(full, count - start) for start in range(0, count, full)]
    Parallel(n_jobs=config.jobs)(
        delayed(_shard)(config, number, size, families) for number, size in enumerate(sizes)
    )


def chosen(names: Sequence[str], held_out: bool) -> dict[str, Family]:
    """The families of these names, in the order of the table whatever the order of the names; all for none.

    Raises:
        InvalidInput: if there is no such family.
    """
    every = HELD_OUT if held_out else TRAINING
    unknown = sorted(set(names) - set(every))
    if unknown:
        raise InvalidInput("families", f"no {', '.join(unknown)}", ", ".join(every))
    return {name: family for name, family in every.items() if not names or name in names}


def _shard(config: GenerateConfig, number: int, size: int, families: dict[str, Family]) -> None:
    path = config.out / f"shard-{number:05d}.npz"
    routes = config.routes is not None
    if _whole(path, size, routes):
        return
    entropy = [config.seed, number, int(config.held_out)]
    content = int(np.random.SeedSequence(entropy).generate_state(1)[0])
    if routes:
        write_routes(list(synthetic_routes(content, size, families)), path)
    else:
        write_shard(list(synthetic_pairs(content, size, families, config.mix, config.kinds)), path)
    print(f"{path}: {size} {'routes' if routes else 'pairs'}", flush=True)


def _whole(path: Path, size: int, routes: bool) -> bool:
    if not path.exists():
        return False
    try:
        return len(RouteShard(path) if routes else Shard(path)) == size
    except CorruptData:
        return False
