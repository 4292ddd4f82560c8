"""`python -m imop.training.generate`: write shards of synthetic pairs; run again, it goes on."""

import argparse
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed

from imop.errors import CorruptData
from imop.training.families import HELD_OUT, TRAINING
from imop.training.shards import Shard, write_shard
from imop.training.synthetic import synthetic_pairs

SHARD = 500


def generate(out: Path, pairs: int, seed: int, jobs: int, held_out: bool = False) -> None:
    """Write `pairs` pairs to numbered shards in `out`; whole shards that are there stay.

    Args:
        out: folder.
        pairs: how many.
        seed: with the shard's number and size it determines the content.
        jobs: worker processes.
        held_out: whether of the families for testing only.
    """
    out.mkdir(parents=True, exist_ok=True)
    sizes = [min(SHARD, pairs - start) for start in range(0, pairs, SHARD)]
    Parallel(n_jobs=jobs)(
        delayed(_shard)(out / f"shard-{i:05d}.npz", i, size, seed, held_out) for i, size in enumerate(sizes)
    )


def _shard(path: Path, number: int, size: int, seed: int, held_out: bool) -> None:
    if _whole(path, size):
        return
    content = int(np.random.SeedSequence([seed, number, int(held_out)]).generate_state(1)[0])
    families = HELD_OUT if held_out else TRAINING
    write_shard(list(synthetic_pairs(content, size, families)), path)
    print(f"{path}: {size} pairs", flush=True)


def _whole(path: Path, size: int) -> bool:
    if not path.exists():
        return False
    try:
        return len(Shard(path)) == size
    except CorruptData:
        return False


def main() -> None:
    """Parse the command line."""
    parser = argparse.ArgumentParser(prog="python -m imop.training.generate", description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder of the shards")
    parser.add_argument("--pairs", type=int, required=True)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--held-out", action="store_true", help="families for testing only")
    args = parser.parse_args()
    generate(args.out, args.pairs, args.seed, args.jobs, args.held_out)


if __name__ == "__main__":
    main()
