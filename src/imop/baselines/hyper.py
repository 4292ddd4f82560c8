"""A hyper-network that makes adapters from a demonstration, after Hyper-Decision Transformer.

The network in the manner of RVT stays frozen. From what it sees at the keyframes of the demonstration and
from the actions there, the hyper-network makes the weights of a bottleneck behind every block (Xu et al.
2023, arXiv 2304.08487). It is trained on base tasks: adapters from one demonstration shall help in others of
the same task.

imop baselines hyper --weights runs/baselines/views --stores A.zarr --out runs/baselines/views_hdt
"""

import json
import shlex
import sys
import time
from collections import defaultdict
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from rich.console import Console
from torch import Tensor, nn
from torch.nn import functional as F

from imop.baselines.batch import Targets, batch_of
from imop.baselines.samples import Samples
from imop.baselines.train import descend
from imop.baselines.views import ViewsNetwork
from imop.baselines.weights import fast_products, load_network, read_weights, save_weights
from imop.errors import CorruptData
from imop.files import replaced, writable_folder
from imop.networks.descent import schedule

CHECKPOINT = "checkpoint.pt"
_ACTION = 11


class HyperNetwork(nn.Module):
    """From descriptions of keyframes to adapters; at first the adapters change nothing.

    Args:
        described: channels of a keyframe's description.
        blocks: how many adapters.
        size: numbers of one adapter, the first half of which leads down.
        width: of the task's embedding.
    """

    def __init__(self, described: int, blocks: int, size: int, width: int = 64):
        super().__init__()
        self.keyframe = nn.Sequential(
            nn.Linear(described + _ACTION, 2 * width), nn.GELU(), nn.Linear(2 * width, width)
        )
        self.block = nn.Parameter(torch.randn(blocks, width) * 0.3)
        self.task = nn.Linear(width, width)
        self.down, self.up = nn.Linear(width, size // 2), nn.Linear(width, size // 2)
        nn.init.normal_(self.down.bias, std=0.05)
        nn.init.zeros_(self.up.weight)
        nn.init.zeros_(self.up.bias)

    def forward(self, keyframes: list[Tensor]) -> Tensor:
        """(B, blocks, size) adapters for B demonstrations, each (K, described + action)."""
        tasks = torch.stack([self.keyframe(each).mean(0) for each in keyframes])
        x = F.gelu(self.task(tasks)[:, None] + self.block)
        return torch.cat([self.down(x), self.up(x)], -1)


def described(network: ViewsNetwork, samples: Samples, numbers: NDArray[np.int64]) -> Tensor:
    """(N, described + action) what the frozen network sees at keyframes, and what is done there."""
    inputs, targets = batch_of(samples, numbers)
    with fast_products():
        seen = network.describe(inputs)
    return torch.cat([seen, _action(targets)], 1)


def _action(targets: Targets) -> Tensor:
    T = targets.pose
    flags = torch.stack([targets.gripper_open, targets.allow_collisions], 1)
    return torch.cat([T[:, :3, 3], T[:, :3, :2].flatten(1), flags], 1)


def make_hyper_network(network: ViewsNetwork) -> HyperNetwork:
    """One that fits the network, with random weights."""
    return HyperNetwork(2 * network.config.width, *network.adapters)


@dataclass(frozen=True)
class HyperConfig:
    """How to train the hyper-network.

    Attributes:
        weights: folder of the network in the manner of RVT.
        stores: demonstrations of base tasks.
        out: folder for the hyper-network.
        cache: folder in which the clouds of every demonstration are kept.
        steps: of the optimizer.
        batch: samples of a step, each with a demonstration of its task.
        learning_rate: at its peak.
        warm_up: steps until the peak.
        every: steps between checkpoints.
        held_back: every so many-th demonstration is not learnt, as in the training of the network.
        seed: of weights and what is drawn.
    """

    weights: Path
    stores: tuple[Path, ...]
    out: Path
    cache: Path = Path("runs/baselines/samples")
    steps: int = 1000
    batch: int = 16
    learning_rate: float = 1e-3
    warm_up: int = 50
    every: int = 250
    held_back: int = 20
    seed: int = 0


def train_hyper(
    config: HyperConfig, samples: Samples, console: Console | None = None, stop_at: int | None = None
) -> HyperNetwork:
    """Train from the checkpoint in `config.out`, or from the beginning.

    Raises:
        AssetMissing: if there is no network.
        CorruptData: if the checkpoint cannot be read.
    """
    writable_folder(config.out)
    network, card = load_network(config.weights, "views")
    assert isinstance(network, ViewsNetwork)
    network.requires_grad_(False)
    torch.manual_seed(config.seed)
    hyper = make_hyper_network(network)
    optimizer = torch.optim.AdamW(hyper.parameters(), lr=config.learning_rate, weight_decay=0.01)
    step, seconds = _resume(config.out / CHECKPOINT, hyper, optimizer)
    pairs = _Pairs(samples, config.held_back)
    shown = cache(lambda episode: described(network, samples, samples.of([episode])))
    started, last = time.monotonic() - seconds, min(config.steps, stop_at or config.steps)
    while step < last:
        rng = np.random.default_rng((config.seed, step))
        torch.manual_seed(int(rng.integers(2**31)))
        numbers, episodes = pairs.draw(config.batch, rng)
        inputs, targets = batch_of(samples, numbers, rng)
        keyframes = [shown(episode) for episode in episodes]
        for group in optimizer.param_groups:
            group["lr"] = config.learning_rate * schedule(step, config.warm_up, config.steps)
        with fast_products():
            parts = network.loss(inputs, targets, hyper(keyframes))
        descend(hyper, optimizer, parts, 5.0)
        step += 1
        if step % config.every == 0 or step == last:
            reached: dict[str, Any] = {"step": step, "seconds": round(time.monotonic() - started)}
            reached |= {name: round(float(value.detach()), 4) for name, value in parts.items()}
            _save(config, hyper, optimizer, reached, card["sha256"], samples)
            if console is not None:
                console.print(json.dumps(reached))
    return hyper.eval()


class _Pairs:
    """Samples, each with a demonstration of the same instruction that is not its own."""

    def __init__(self, samples: Samples, held_back: int):
        groups: dict[str, list[int]] = defaultdict(list)
        for episode, instruction in enumerate(samples.instructions):
            if episode % held_back != held_back - 1:
                groups[instruction].append(episode)
        self._samples, self._groups = samples, [group for group in groups.values() if len(group) > 1]

    def draw(self, count: int, rng: np.random.Generator) -> tuple[NDArray[np.int64], list[int]]:
        numbers, shown = [], []
        for group in rng.integers(len(self._groups), size=count):
            own, other = rng.choice(self._groups[group], 2, replace=False)
            numbers.append(rng.choice(self._samples.of([own])))
            shown.append(int(other))
        return np.array(numbers), shown


def _resume(path: Path, hyper: HyperNetwork, optimizer: torch.optim.Optimizer) -> tuple[int, float]:
    if not path.is_file():
        return 0, 0.0
    try:
        saved = torch.load(path, map_location="cpu", weights_only=True)
        hyper.load_state_dict(saved["hyper"])
        optimizer.load_state_dict(saved["optimizer"])
        return int(saved["step"]), float(saved["seconds"])
    except Exception as error:
        raise CorruptData(path, f"is not a checkpoint of this hyper-network ({error})") from error


def _save(
    config: HyperConfig,
    hyper: HyperNetwork,
    optimizer: torch.optim.Optimizer,
    reached: dict[str, Any],
    backbone: str,
    samples: Samples,
) -> None:
    saved = {"hyper": hyper.state_dict(), "optimizer": optimizer.state_dict()}
    with replaced(config.out / CHECKPOINT) as temporary:
        torch.save(saved | {"step": reached["step"], "seconds": reached["seconds"]}, temporary)
    card = {
        "in_the_manner_of": "Hyper-Decision Transformer, on RVT",
        "backbone": backbone,
        "stores": [store.name for store in config.stores],
        "demonstrations": len(samples.instructions),
        "batch": config.batch,
        "command": shlex.join(["python", "-m", "imop.baselines.hyper", *sys.argv[1:]]),
        **reached,
    }
    save_weights(hyper, config.out, card)


def load_hyper_network(folder: Path, network: ViewsNetwork, backbone: str) -> HyperNetwork:
    """A trained hyper-network for this network, whose weights have the hash `backbone`.

    Raises:
        AssetMissing: if there is none; it names the command that trains one.
        CorruptData: if it is damaged, or was trained for other weights.
    """
    views = folder.parent / "views"
    command = f"imop baselines hyper --weights {views} --stores STORE ... --out {folder}"
    weights, card = read_weights(folder, command)
    if card.get("backbone") != backbone:
        raise CorruptData(folder, "was trained for other weights of the network", f"train again: {command}")
    hyper = make_hyper_network(network)
    try:
        hyper.load_state_dict(weights)
    except RuntimeError as error:
        raise CorruptData(folder, f"does not fit the network ({error})", f"train again: {command}") from error
    return hyper.eval()
