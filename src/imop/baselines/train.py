"""Training of a regressor on recorded demonstrations, stopped and resumed at any step without a trace.

imop baselines train --network views --stores rlbench.zarr tabletop.zarr --out runs/baselines/views
"""

import json
import shlex
import sys
import time
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import torch
from numpy.typing import NDArray
from rich.console import Console
from torch import Tensor, nn

from imop.baselines.batch import batch_of
from imop.baselines.measure import measure
from imop.baselines.samples import Samples, joined, stored_samples
from imop.baselines.weights import Regressor, fast_products, make_network, save_network
from imop.errors import CorruptData, InvalidInput
from imop.files import replaced, writable_folder
from imop.geometry.perception import Perception
from imop.networks.descent import kept, schedule
from imop.robots.panda import panda_self_filter

CHECKPOINT, LOG = "checkpoint.pt", "log.jsonl"


@dataclass(frozen=True)
class RegressorConfig:
    """How to train.

    Attributes:
        network: points, in the manner of Act3D, or views, in the manner of RVT.
        stores: demonstrations, as `imop collect` writes them.
        out: folder of the checkpoint, the weights, their card and the log.
        cache: folder in which the clouds of every demonstration are kept.
        steps: optimizer steps in all.
        batch: samples of a step.
        learning_rate: at its peak.
        warm_up: steps until the peak; a cosine to 1 % follows.
        weight_decay: of AdamW.
        clip: largest norm of the gradient.
        ema: decay of the averaged weights, which are those that are saved and validated.
        every: steps between validations and checkpoints.
        held_back: every so many-th demonstration is for validation only.
        validated: samples of these.
        seed: of weights, samples and augmentation.
    """

    network: Literal["points", "views"]
    stores: tuple[Path, ...]
    out: Path
    cache: Path = Path("runs/baselines/samples")
    steps: int = 6000
    batch: int = 16
    learning_rate: float = 6e-4
    warm_up: int = 300
    weight_decay: float = 0.01
    clip: float = 5.0
    ema: float = 0.998
    every: int = 500
    held_back: int = 20
    validated: int = 128
    seed: int = 0

    def check(self) -> None:
        """Not done when it is made, where tyro would tell it in its own words.

        Raises:
            InvalidInput: for a number out of its range.
        """
        for name, least in (("steps", 1), ("batch", 1), ("every", 1), ("held_back", 2), ("validated", 1)):
            if getattr(self, name) < least:
                raise InvalidInput(name, f"{getattr(self, name)}", f"a whole number from {least} on")
        if not 0 <= self.ema < 1:
            raise InvalidInput("ema", f"{self.ema}", "a number from 0 up to, but not, 1")


class TrainState:
    """All that a checkpoint holds: weights, their average, the optimizer, the step and the time."""

    def __init__(self, network: Regressor, config: RegressorConfig):
        self.network, self.average = network, deepcopy(network).requires_grad_(False)
        self.optimizer = torch.optim.AdamW(
            network.parameters(), lr=config.learning_rate, weight_decay=config.weight_decay
        )
        self.step, self.seconds = 0, 0.0

    def load(self, path: Path) -> None:
        """Continue from `path` if it is there.

        Raises:
            CorruptData: if it is not a checkpoint of this network.
        """
        if not path.is_file():
            return
        try:
            saved = torch.load(path, map_location="cpu", weights_only=True)
            self.network.load_state_dict(saved["network"])
            self.average.load_state_dict(saved["average"])
            self.optimizer.load_state_dict(saved["optimizer"])
            self.step, self.seconds = int(saved["step"]), float(saved["seconds"])
        except Exception as error:
            raise CorruptData(path, f"is not a checkpoint of this network ({error})") from error

    def save(self, path: Path) -> None:
        """Write the checkpoint, whole or not at all."""
        saved: dict[str, Any] = {
            "network": self.network.state_dict(),
            "average": self.average.state_dict(),
            "optimizer": self.optimizer.state_dict(),
            "step": self.step,
            "seconds": self.seconds,
        }
        with replaced(path) as temporary:
            torch.save(saved, temporary)

    def follow(self, decay: float) -> None:
        """Move the average towards the weights."""
        keep = kept(decay, self.step)
        for mean, new in zip(self.average.parameters(), self.network.parameters(), strict=True):
            mean.lerp_(new.detach(), 1 - keep)


def train(
    config: RegressorConfig,
    samples: Samples,
    stop_at: int | None = None,
    shape: dict[str, Any] | None = None,
    console: Console | None = None,
) -> list[float]:
    """Train from the checkpoint in `config.out`, or from the beginning.

    Args:
        config: how.
        samples: of all demonstrations.
        stop_at: stop after this step, with a checkpoint.
        shape: sizes of the network, see `make_network`.
        console: for a line per validation.

    Returns:
        The loss of every step taken.

    Raises:
        InvalidInput: for a number out of its range.
        CorruptData: if the checkpoint cannot be read.
    """
    config.check()
    writable_folder(config.out)
    torch.manual_seed(config.seed)
    state = TrainState(make_network(config.network, shape), config)
    state.load(config.out / CHECKPOINT)
    episodes = np.arange(len(samples.instructions))
    held_back = episodes % config.held_back == config.held_back - 1
    learnt, kept = samples.of(episodes[~held_back]), samples.of(episodes[held_back])
    card = card_of(config, samples, len(learnt))
    last, history, started = min(config.steps, stop_at or config.steps), [], time.monotonic()
    while state.step < last:
        history.append(_step(state, samples, learnt, config))
        if state.step % config.every == 0 or state.step == last:
            state.seconds += time.monotonic() - started
            recent = {n: float(np.mean([h[n] for h in history[-config.every :]])) for n in history[-1]}
            reached = {"step": state.step, "seconds": round(state.seconds), "losses": recent}
            reached["validation"] = measure(state.average, samples, kept, config.validated)
            _write(state, config, {**card, **reached})
            if console is not None:
                console.print(_line(reached))
            started = time.monotonic()
    return [sum(parts.values()) for parts in history]


def _step(
    state: TrainState, samples: Samples, learnt: NDArray[np.int64], config: RegressorConfig
) -> dict[str, float]:
    """One step; what it draws depends on its number alone, so that it is the same after a stop."""
    rng = np.random.default_rng((config.seed, state.step))
    torch.manual_seed(int(rng.integers(2**31)))
    inputs, targets = batch_of(samples, rng.choice(learnt, config.batch), rng)
    for group in state.optimizer.param_groups:
        group["lr"] = config.learning_rate * schedule(state.step, config.warm_up, config.steps)
    with fast_products():
        parts = state.network.loss(inputs, targets)
    descend(state.network, state.optimizer, parts, config.clip)
    state.step += 1
    state.follow(config.ema)
    return {name: float(value.detach()) for name, value in parts.items()}


def descend(
    trained: nn.Module, optimizer: torch.optim.Optimizer, parts: dict[str, Tensor], clip: float
) -> None:
    """One step down the sum of the losses."""
    optimizer.zero_grad()
    torch.stack(list(parts.values())).sum().backward()  # type: ignore[no-untyped-call]
    torch.nn.utils.clip_grad_norm_(trained.parameters(), clip)
    optimizer.step()


def card_of(config: RegressorConfig, samples: Samples, learnt: int) -> dict[str, Any]:
    """What went into the weights, as far as it is known before training."""
    return {
        "in_the_manner_of": {"points": "Act3D", "views": "RVT"}[config.network],
        "stores": [store.name for store in config.stores],
        "demonstrations": len(samples.instructions),
        "samples": len(samples),
        "samples_learnt": learnt,
        "batch": config.batch,
        "steps": config.steps,
        "seed": config.seed,
        "language": "hashed words, learnt with the network; no pretrained model",
        "command": shlex.join(["python", "-m", "imop.baselines.train", *sys.argv[1:]]),
        "licence": "MIT",
        "instructions": sorted(set(samples.instructions)),
    }


def _write(state: TrainState, config: RegressorConfig, card: dict[str, Any]) -> None:
    with (config.out / LOG).open("a") as log:
        reached = {name: card[name] for name in ("step", "seconds", "samples_learnt", "losses", "validation")}
        log.write(json.dumps(reached) + "\n")
    state.save(config.out / CHECKPOINT)
    save_network(state.average, config.out, card)


def _line(reached: dict[str, Any]) -> str:
    numbers = {**reached["losses"], **reached["validation"]}
    told = ", ".join(f"{name} {value:.3f}" for name, value in numbers.items())
    return f"step {reached['step']}, {reached['seconds']} s: {told}"


def read_stores(stores: tuple[Path, ...], cache: Path, console: Console) -> Samples:
    """Samples of several stores, their clouds made once and kept in `cache`.

    Raises:
        InvalidInput: if no store is named, or one is not there or empty.
    """
    if not stores:
        raise InvalidInput("stores", "none", "at least one store of demonstrations")
    perception = Perception(panda_self_filter().is_robot)
    parts = []
    for store in stores:
        with console.status(f"clouds of {store}"):
            parts.append(stored_samples(store, cache, perception))
        console.print(f"{store}: {len(parts[-1])} keyframes of {len(parts[-1].instructions)} demonstrations")
    return joined(parts)
