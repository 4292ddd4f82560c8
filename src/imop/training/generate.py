"""`python -m imop.training.generate`: write shards of synthetic pairs or routes; run again, it goes on."""

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed

from imop.errors import CorruptData, InvalidInput
from imop.training.families import HELD_OUT, TRAINING, Family
from imop.training.instances import VARIATIONS, shares
from imop.training.plans import SHARES, check_kinds
from imop.training.route_shards import RouteShard, write_routes
from imop.training.routes import synthetic_routes
from imop.training.shards import Shard, write_shard
from imop.training.synthetic import SAME_ONLY, synthetic_pairs

SHARD = 500
ROUTE_SHARD = 100


def generate(
    out: Path,
    count: int,
    seed: int,
    jobs: int,
    held_out: bool = False,
    routes: bool = False,
    names: Sequence[str] = (),
    mix: Sequence[float] = SAME_ONLY,
    kinds: Sequence[str] = (),
) -> None:
    """Write `count` pairs, or routes, to numbered shards in `out`; whole shards that are there stay.

    Args:
        out: folder.
        count: how many.
        seed: with the shard's number and size it determines the content.
        jobs: worker processes.
        held_out: whether of the families for testing only.
        routes: whether examples for the routing network instead of pairs.
        names: of the families that the scenes are made of; none for all.
        mix: of pairs, as in `synthetic_pairs`.
        kinds: of what is done in pairs (`plans.SHARES`); none for all.

    Raises:
        InvalidInput: if there is no such family or kind, or the mix is not four shares.
    """
    families = chosen(names, held_out)
    check_kinds(kinds)
    shares(mix)
    out.mkdir(parents=True, exist_ok=True)
    full = ROUTE_SHARD if routes else SHARD
    sizes = [min(full, count - start) for start in range(0, count, full)]
    Parallel(n_jobs=jobs)(
        delayed(_shard)(
            out / f"shard-{i:05d}.npz", size, _content(seed, i, held_out), families, routes, mix, kinds
        )
        for i, size in enumerate(sizes)
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


def _content(seed: int, number: int, held_out: bool) -> int:
    return int(np.random.SeedSequence([seed, number, int(held_out)]).generate_state(1)[0])


def _shard(
    path: Path,
    size: int,
    content: int,
    families: dict[str, Family],
    routes: bool,
    mix: Sequence[float],
    kinds: Sequence[str],
) -> None:
    if _whole(path, size, routes):
        return
    if routes:
        write_routes(list(synthetic_routes(content, size, families)), path)
    else:
        write_shard(list(synthetic_pairs(content, size, families, mix, kinds)), path)
    print(f"{path}: {size} {'routes' if routes else 'pairs'}", flush=True)


def _whole(path: Path, size: int, routes: bool) -> bool:
    if not path.exists():
        return False
    try:
        return len(RouteShard(path) if routes else Shard(path)) == size
    except CorruptData:
        return False


def main() -> None:
    """Parse the command line."""
    parser = argparse.ArgumentParser(prog="python -m imop.training.generate", description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder of the shards")
    kind = parser.add_mutually_exclusive_group(required=True)
    kind.add_argument("--pairs", type=int, help="number of pairs, for the region and matching networks")
    kind.add_argument("--routes", type=int, help="number of routes, for the routing network")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--held-out", action="store_true", help="families for testing only")
    parser.add_argument("--families", nargs="+", default=(), metavar="NAME", help="only these; default: all")
    parser.add_argument(
        "--kinds", nargs="+", default=(), metavar="KIND", help="only pairs of these: " + ", ".join(SHARES)
    )
    parser.add_argument(
        "--mix",
        nargs=len(VARIATIONS),
        type=float,
        default=SAME_ONLY,
        metavar=tuple(name.upper() for name in VARIATIONS),
        help="shares of pairs whose query shows the same things, others in colour, in shape, in both",
    )
    args = parser.parse_args()
    routes = args.routes is not None
    count = args.routes if routes else args.pairs
    generate(
        args.out, count, args.seed, args.jobs, args.held_out, routes, args.families, args.mix, args.kinds
    )


if __name__ == "__main__":
    main()
