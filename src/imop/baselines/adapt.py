"""Fine-tuning on one demonstration of a novel task, of all weights (RVT+FT) or of adapters alone (RVT+HDT).

imop baselines adapt --weights runs/baselines/views --stores novel.zarr --out runs/tuned/views

fine-tunes all weights on the demonstrations of stores together, as the paper does it, to see what that does
to the base tasks: `imop eval --methods rvt --baselines runs/tuned` asks the new weights.
"""

import shlex
import sys
from copy import deepcopy
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import torch
from rich.console import Console
from torch import Tensor, nn

from imop.baselines.batch import batch_of
from imop.baselines.measure import measure
from imop.baselines.samples import Samples
from imop.baselines.train import descend, read_stores
from imop.baselines.views import ViewsNetwork
from imop.baselines.weights import fast_products, load_network, save_network
from imop.errors import InvalidInput
from imop.networks.descent import schedule


@dataclass(frozen=True)
class AdaptConfig:
    """How to fine-tune.

    Attributes:
        steps: of the optimizer.
        batch: samples of a step, drawn with the augmentation of the training.
        learning_rate: at its peak; a cosine follows.
        warm_up: steps until the peak.
        clip: largest norm of the gradient.
        seed: of what is drawn.
    """

    steps: int = 150
    batch: int = 8
    learning_rate: float = 5e-4
    warm_up: int = 10
    clip: float = 5.0
    seed: int = 0

    def check(self) -> None:
        """Not done when it is made, where tyro would tell it in its own words.

        Raises:
            InvalidInput: for a number out of its range.
        """
        for name in ("steps", "batch"):
            if getattr(self, name) < 1:
                raise InvalidInput(name, f"{getattr(self, name)}", "a whole number from 1 on")


ADAPTERS = AdaptConfig(learning_rate=2e-3)
"""For adapters, which are few and need larger steps."""


def fine_tuned(network: ViewsNetwork, samples: Samples, config: AdaptConfig) -> ViewsNetwork:
    """A copy of which all weights are trained on the samples."""
    tuned = deepcopy(network).train().requires_grad_(True)
    _descend(tuned, tuned, samples, config, None)
    return tuned.eval()


def tuned_adapters(
    network: ViewsNetwork, samples: Samples, adapters: Tensor, config: AdaptConfig = ADAPTERS
) -> Tensor:
    """(1, blocks, size) adapters trained on the samples from `adapters` on; the network stays as it is."""
    trained = nn.ParameterList([nn.Parameter(adapters.detach().clone())])
    frozen = [p for p in network.parameters() if p.requires_grad]
    for parameter in frozen:
        parameter.requires_grad_(False)
    try:
        _descend(network, trained, samples, config, trained[0])
    finally:
        for parameter in frozen:
            parameter.requires_grad_(True)
    return torch.as_tensor(trained[0].detach())


def _descend(
    network: ViewsNetwork, trained: nn.Module, samples: Samples, config: AdaptConfig, adapters: Tensor | None
) -> None:
    optimizer = torch.optim.AdamW(trained.parameters(), lr=config.learning_rate, weight_decay=0.01)
    with torch.random.fork_rng(devices=[]):
        for step in range(config.steps):
            rng = np.random.default_rng((config.seed, step))
            torch.manual_seed(int(rng.integers(2**31)))
            inputs, targets = batch_of(samples, rng.integers(len(samples), size=config.batch), rng)
            for group in optimizer.param_groups:
                group["lr"] = config.learning_rate * schedule(step, config.warm_up, config.steps)
            with fast_products():
                parts = network.loss(inputs, targets, adapters)
            descend(trained, optimizer, parts, config.clip)


@dataclass(frozen=True)
class Fold:
    """What is fine-tuned on what.

    Attributes:
        weights: folder of a network in the manner of RVT.
        stores: with the demonstrations, one of each novel task and variation.
        out: folder for the new weights.
        cache: folder in which the clouds of every demonstration are kept.
        steps: of the optimizer; if None, for each demonstration as many as one alone takes.
        batch: samples of a step.
        learning_rate: at its peak.
    """

    weights: Path
    stores: tuple[Path, ...]
    out: Path
    cache: Path = Path("runs/baselines/samples")
    steps: int | None = None
    batch: int = 8
    learning_rate: float = 5e-4


def adapt(fold: Fold, console: Console) -> None:
    """Fine-tune all weights on all demonstrations together and write them, with a card.

    Raises:
        AssetMissing: if there are no weights.
        InvalidInput: if there are no demonstrations, or a number is out of its range.
    """
    network, card = load_network(fold.weights, "views")
    assert isinstance(network, ViewsNetwork)
    samples = read_stores(fold.stores, fold.cache, console)
    steps = AdaptConfig().steps * len(samples.instructions) if fold.steps is None else fold.steps
    config = AdaptConfig(steps, fold.batch, fold.learning_rate)
    config.check()
    tuned = fine_tuned(network, samples, config)
    everything = np.arange(len(samples))
    card |= {
        "fine_tuned": {
            "from": card["sha256"],
            "stores": [store.name for store in fold.stores],
            "demonstrations": len(samples.instructions),
            **asdict(config),
            "before": measure(network, samples, everything, 128),
            "after": measure(tuned, samples, everything, 128),
            "command": shlex.join(["imop", *sys.argv[1:]]),
        },
        "instructions": sorted({*card["instructions"], *samples.instructions}),
    }
    save_network(tuned, fold.out, card)
    console.print(f"{fold.out}: place error {card['fine_tuned']['after']['place'] * 1000:.0f} mm")
