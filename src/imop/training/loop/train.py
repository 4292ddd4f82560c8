"""Training of the networks, together or apart, stopped and resumed at any step without a trace.

imop train --out runs/train --train PATH --validate PATH
imop train --out runs/routing --networks routing --routes PATH --validate-routes PATH
"""

import json
import os
import shlex
import sys
import time
from collections.abc import Callable, Iterator
from itertools import repeat
from pathlib import Path
from typing import Any

import torch
from rich.console import Console
from torch import Tensor, nn
from torch.optim.swa_utils import AveragedModel

from imop.errors import CorruptData, InvalidInput
from imop.extras import extra
from imop.files import replaced
from imop.networks.descent import has_fast_bfloat16, kept, schedule
from imop.networks.model import NETWORKS, Model, ModelConfig, load_model, part_of, save_model
from imop.training.config import TrainConfig
from imop.training.data.datasets import PairDataset, RouteDataset, loader
from imop.training.data.pairs import PairBatch
from imop.training.data.route_batch import RouteBatch
from imop.training.loop.metrics import validate, validate_routes
from imop.training.loop.objective import Objective
from imop.training.loop.progress import TrainingProgress

with extra("train"):
    from lightning_fabric import Fabric
    from torch.utils.tensorboard import SummaryWriter

CHECKPOINT = "checkpoint.pt"
LOG = "log.jsonl"

Batch = tuple[PairBatch | None, RouteBatch | None]


class TrainState:
    """Everything that a checkpoint holds: weights, their average, the optimizer, the step."""

    def __init__(self, model: Model, config: TrainConfig):
        self.model = model
        self.networks = tuple(name for name in NETWORKS if name in config.networks)
        self.average = AveragedModel(model, multi_avg_fn=_moving_average(config.ema))
        trained = [p for name in self.networks for p in getattr(model, name).parameters()]
        self.optimizer = torch.optim.AdamW(trained, lr=config.learning_rate, weight_decay=config.weight_decay)
        self.step = 0

    def begin(self, weights: Path) -> None:
        """Take the weights in a folder, of all networks.

        Raises:
            CorruptData: if they cannot be read, or are of networks of another shape.
        """
        try:
            self.model.load_state_dict(load_model(weights).state_dict())
        except RuntimeError as error:
            raise CorruptData(weights, f"holds networks of another shape ({error})") from error

    def load(self, path: Path) -> None:
        """Continue from `path` if it is there.

        Raises:
            CorruptData: if it is not a checkpoint of these networks.
        """
        if not path.is_file():
            return
        try:
            saved = torch.load(path, map_location="cpu", weights_only=True)
            self._load(self.model, saved["model"], "")
            self._load(self.average, saved["average"], "module.")
            self.average.n_averaged.copy_(saved["average"]["n_averaged"])
            self.optimizer.load_state_dict(saved["optimizer"])
            self.step = int(saved["step"])
        except Exception as error:
            raise CorruptData(path, f"is not a checkpoint of these networks ({error})") from error

    def _load(self, module: nn.Module, weights: dict[str, Tensor], prefix: str) -> None:
        """Only of networks that are trained: the others may have had another shape then."""
        for name in self.networks:
            module.get_submodule(prefix + name).load_state_dict(part_of(weights, prefix + name))

    def save(self, path: Path) -> None:
        """Write the checkpoint, whole or not at all."""
        saved: dict[str, Any] = {
            "model": self.model.state_dict(),
            "average": self.average.state_dict(),
            "optimizer": self.optimizer.state_dict(),
            "step": self.step,
        }
        with replaced(path) as temporary:
            torch.save(saved, temporary)


def train(
    config: TrainConfig,
    model_config: ModelConfig | None = None,
    stop_at: int | None = None,
    console: Console | None = None,
) -> list[dict[str, float]]:
    """Train from the checkpoint in `config.out`, or from the beginning.

    Args:
        config: how.
        model_config: shape of the networks; `small` if None.
        stop_at: stop after this step, with a checkpoint.
        console: for a line per report and, on a terminal, the progress; standard output if None.

    Returns:
        The losses of every step taken.

    Raises:
        CorruptData: if shards, the first weights or the checkpoint cannot be read.
        InvalidInput: if a number is out of its range, there is nothing to train on, or the networks do not
            go together.
    """
    shape = model_config or ModelConfig()
    _check(config, shape)
    fabric = _fabric()
    fabric.launch()
    torch.manual_seed(config.seed)
    state = TrainState(Model(shape), config)
    if config.weights is not None:
        state.begin(config.weights)
    state.load(config.out / CHECKPOINT)
    module, optimizer = fabric.setup(Objective(state.model, config.networks), state.optimizer)
    state.average.to(fabric.device)
    last = min(config.steps, stop_at or config.steps)
    out = (console or Console()) if fabric.is_global_zero else Console(quiet=True)
    history = []
    with TrainingProgress(out, state.step, last) as progress:
        for batch in _batches(config, state, last, fabric.world_size, fabric.global_rank):
            history.append(_step(fabric, module, optimizer, batch, config, state))
            progress.step(history[-1])
            if state.step % config.every == 0 or state.step == last:
                if fabric.is_global_zero:
                    progress.report(_report(config, state, history[-config.every :]))
                fabric.barrier()
    return history


def _fabric() -> Fabric:
    """As many processes as the launcher started, which Fabric does not ask for by itself: one without one."""
    world = int(os.environ.get("WORLD_SIZE", 1))
    here = int(os.environ.get("LOCAL_WORLD_SIZE", world))
    return Fabric(devices=here, num_nodes=world // here, strategy="ddp" if world > 1 else "auto")


def _check(config: TrainConfig, shape: ModelConfig) -> None:
    config.check_numbers()
    pairs, routes = set(config.networks) - {"routing"}, "routing" in config.networks
    if not config.networks:
        raise InvalidInput("networks", "none", f"some of {', '.join(NETWORKS)}")
    for name, needed in (("train", bool(pairs)), ("routes", routes)):
        if needed != bool(getattr(config, name)):
            has = "no folder" if needed else "a folder"
            raise InvalidInput(name, f"{has} for {', '.join(config.networks)}", "shards of what is trained")
    wanted = {"analytic": set(), "from_matches": {"matching", "pose"}, "regressed": {"pose"}}[
        shape.pose.method
    ]
    if pairs and not (wanted <= pairs and ("pose" in pairs) == ("pose" in wanted)):
        accepted = f"{' and '.join(sorted(wanted)) or 'no pose'} where the pose is {shape.pose.method}"
        raise InvalidInput("networks", ", ".join(config.networks), accepted)


def _batches(config: TrainConfig, state: TrainState, last: int, world: int, rank: int) -> Iterator[Batch]:
    """The batches of one process from the state's step on; samples count over all processes and steps."""
    numbers = [
        (step * world + rank) * config.batch + i
        for step in range(state.step, last)
        for i in range(config.batch)
    ]
    shape = state.model.config
    pairs: Iterator[PairBatch | None] = repeat(None)
    routes: Iterator[RouteBatch | None] = repeat(None)
    if config.train:
        dataset = PairDataset(config.train, shape, config.seed, shares=config.shares)
        pairs = iter(loader(dataset, numbers, config.batch, config.workers))
    if config.routes:
        routed = RouteDataset(config.routes, shape, config.seed)
        routes = iter(loader(routed, numbers, config.batch, config.workers))
    return zip(pairs, routes, strict=False)


def _step(
    fabric: Fabric,
    module: nn.Module,
    optimizer: torch.optim.Optimizer,
    batch: Batch,
    config: TrainConfig,
    state: TrainState,
) -> dict[str, float]:
    for group in optimizer.param_groups:
        group["lr"] = config.learning_rate * schedule(state.step, config.warm_up, config.steps)
    with torch.autocast(fabric.device.type, torch.bfloat16, enabled=_halved(config, fabric.device)):
        parts = module(*(None if part is None else part.to(fabric.device) for part in batch))
    loss = torch.stack(list(parts.values())).sum()
    optimizer.zero_grad()
    fabric.backward(loss)
    torch.nn.utils.clip_grad_norm_(module.parameters(), config.clip)
    optimizer.step()
    state.average.update_parameters(state.model)
    state.step += 1
    return {name: float(value.detach()) for name, value in parts.items()}


def _halved(config: TrainConfig, device: torch.device) -> bool:
    """Whether products are made in bfloat16."""
    if config.precision == "auto":
        return device.type != "cpu" or has_fast_bfloat16()
    return config.precision == "bfloat16"


def _report(config: TrainConfig, state: TrainState, recent: list[dict[str, float]]) -> str:
    """Validate, log, and write checkpoint and weights; returns a line for people."""
    means = {name: sum(r[name] for r in recent) / len(recent) for name in recent[0]}
    average = state.average.module
    assert isinstance(average, Model)
    found = {folder.name: validate(average, folder, config.validation_pairs) for folder in config.validate}
    for folder in config.validate_routes:
        found[folder.name] = validate_routes(average, folder, config.validation_pairs)
    reached = {"step": state.step, "losses": means, "validation": found}
    config.out.mkdir(parents=True, exist_ok=True)
    with (config.out / LOG).open("a") as log:
        log.write(json.dumps({**reached, "time": time.time()}) + "\n")
    with SummaryWriter(str(config.out)) as writer:
        for name, value in means.items():
            writer.add_scalar(f"loss/{name}", value, state.step)
        for source, metrics in found.items():
            for name, value in metrics.items():
                writer.add_scalar(f"{source}/{name}", value, state.step)
    state.save(config.out / CHECKPOINT)
    save_model(average, config.out, _card(config) | reached)
    numbers = {**means, **{f"{f} {n}": v for f, metrics in found.items() for n, v in metrics.items()}}
    return f"step {state.step}: " + ", ".join(f"{n} {v:.3f}" for n, v in numbers.items())


def _card(config: TrainConfig) -> dict[str, Any]:
    """What went into the weights, as far as it is known before training."""
    return {
        "data": [folder.name for folder in (*config.train, *config.routes)],
        "shares": list(config.shares),
        "networks": list(config.networks),
        "weights": None if config.weights is None else config.weights.name,
        "batch": config.batch,
        "seed": config.seed,
        "command": shlex.join(sys.argv),
        "licence": "MIT",
    }


def _moving_average(decay: float) -> Callable[..., None]:
    def update(average: list[Tensor], weights: list[Tensor], count: Tensor) -> None:
        keep = kept(decay, float(count))
        for mean, new in zip(average, weights, strict=True):
            mean.lerp_(new, 1 - keep)

    return update
