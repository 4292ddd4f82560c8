"""How to train, apart from the loop so that the command line can show it without waiting for torch."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from imop.errors import InvalidInput

Network = Literal["region", "matching", "routing", "pose"]


@dataclass(frozen=True)
class TrainConfig:
    """How to train.

    Attributes:
        out: folder of the checkpoint, the weights and the log.
        train: folders of shards of pairs to train region and matching on.
        shares: how often each of these folders is drawn from; equally if none are given.
        validate: folders of shards to validate them on, each reported by its name.
        routes: folders of shards of routes to train routing on, equally often.
        validate_routes: folders of shards to validate it on, each reported by its name.
        networks: which are trained; the others stay as they are at the beginning.
        weights: folder with the weights that training begins with; random ones if None.
        steps: optimizer steps in all.
        batch: pairs, and routes, per step and process.
        learning_rate: at its peak.
        warm_up: steps until the peak; a cosine to 1 % follows.
        weight_decay: of AdamW.
        clip: largest norm of the gradient.
        ema: decay of the averaged weights, which are the ones that are saved and validated.
        every: steps between validations and checkpoints.
        validation_pairs: how many pairs, or routes, of each folder.
        seed: of weights, data and augmentation.
        workers: processes that prepare samples.
        precision: of products within the networks; sums and places stay in float32. auto is bfloat16 where
            the processor has fast instructions for it: on a GPU, and on a CPU with AVX-512.
    """

    out: Path
    train: tuple[Path, ...] = ()
    shares: tuple[float, ...] = ()
    validate: tuple[Path, ...] = ()
    routes: tuple[Path, ...] = ()
    validate_routes: tuple[Path, ...] = ()
    networks: tuple[Network, ...] = ("region", "matching")
    weights: Path | None = None
    steps: int = 20_000
    batch: int = 8
    learning_rate: float = 1e-3
    warm_up: int = 300
    weight_decay: float = 0.01
    clip: float = 5.0
    ema: float = 0.998
    every: int = 500
    validation_pairs: int = 200
    seed: int = 0
    workers: int = 1
    precision: Literal["auto", "float32", "bfloat16"] = "auto"

    def check_numbers(self) -> None:
        """Not done when it is made, where tyro would tell it in its own words.

        Raises:
            InvalidInput: for a number out of its range.
        """
        for name in ("steps", "batch", "every", "validation_pairs", "warm_up", "workers", "seed"):
            least = 0 if name in ("warm_up", "workers", "seed") else 1
            if getattr(self, name) < least:
                raise InvalidInput(name, f"{getattr(self, name)}", f"a whole number from {least} on")
        for name in ("learning_rate", "clip"):
            if not 0 < getattr(self, name) < math.inf:
                raise InvalidInput(name, f"{getattr(self, name)}", "a positive number")
        if not 0 <= self.weight_decay < math.inf:
            raise InvalidInput("weight_decay", f"{self.weight_decay}", "0 or a positive number")
        if not 0 <= self.ema < 1:
            raise InvalidInput("ema", f"{self.ema}", "a number from 0 up to, but not, 1")
