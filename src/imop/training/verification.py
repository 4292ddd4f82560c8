"""Training of the verification network on cases; a minute on a CPU.

python -m imop.training.verification --cases DIR [DIR ...] --weights FOLDER --out FOLDER
"""

import json
import shlex
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
import tyro
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional as F

from imop.networks.model import BUNDLED, CARD, load_model, save_model
from imop.networks.verification import VerificationNetwork
from imop.training.cases import Cases, read_cases
from imop.types import FloatArray

PRECISE = 3.0
"""How fast a right candidate is worth less in the choice, the farther it is off."""
BINS = 10
"""Of equal count, in which probabilities are compared with what came true."""


@dataclass(frozen=True)
class VerificationTraining:
    """How to train.

    Attributes:
        cases: folders of cases.
        out: folder of the weights, with all other networks as they were.
        weights: folder of the other networks.
        further: whether the verification network of that folder is trained on, instead of a fresh one.
        held: share of the cases that are kept for the report.
        steps: of AdamW.
        batch: candidates' cases per step.
        learning_rate: at its peak.
        weight_decay: of AdamW.
        dropout: share of the inputs that are replaced by their mean.
        seed: of weights, order and split.
    """

    cases: tuple[Path, ...]
    out: Path
    weights: Path = BUNDLED
    further: bool = False
    held: float = 0.15
    steps: int = 2000
    batch: int = 64
    learning_rate: float = 2e-3
    weight_decay: float = 0.05
    dropout: float = 0.2
    seed: int = 0


class _Grouped:
    """Cases as tensors, by case."""

    def __init__(self, cases: Cases, which: set[int]) -> None:
        kept = np.isin(cases.case, sorted(which))
        self.inputs, self.off = torch.from_numpy(cases.inputs[kept]), torch.from_numpy(cases.off[kept])
        starts = np.flatnonzero(np.diff(cases.case[kept], prepend=-1))
        self.ranges = list(zip(starts, [*starts[1:], len(self.off)], strict=True))

    def take(self, which: np.ndarray) -> tuple[Tensor, Tensor, Tensor]:
        """Inputs, how far off, and the case of each candidate."""
        index = np.concatenate([np.arange(*self.ranges[i]) for i in which])
        case = np.repeat(np.arange(len(which)), [self.ranges[i][1] - self.ranges[i][0] for i in which])
        return self.inputs[index], self.off[index], torch.from_numpy(case)


def loss(logits: Tensor, off: Tensor, case: Tensor) -> Tensor:
    """Cross entropy of each candidate, and of the choice among those of a case; the mean over cases.

    In the choice a right candidate is worth more, the nearer it is: the loss is the negative logarithm of the
    worth that is expected of a candidate drawn by its probability. The likeliest candidate of each case
    counts once more on its own: its probability is told, and as the largest of many it would be too large.

    Args:
        logits: (N,).
        off: (N,) how far the candidate is off; it is right below 1.
        case: (N,) the number of its case, from 0 on.
    """
    count, right = int(case.max()) + 1, off < 1
    each = F.binary_cross_entropy_with_logits(logits, right.to(logits), reduction="none")
    sizes = torch.bincount(case, minlength=count)
    single = logits.new_zeros(count).index_add(0, case, each) / sizes
    some = torch.zeros(count).index_add(0, case, right.float()) > 0
    worth = torch.where(right, logits - PRECISE * off, -1e4)
    total, good = (_logsumexp(x, case, count) for x in (logits, worth))
    choice = torch.where(some, total - good, 0.0).sum() / some.sum().clamp_min(1)
    return single.mean() + 0.5 * choice + each[_likeliest(logits, case, count)].mean()


def _likeliest(logits: Tensor, case: Tensor, count: int) -> Tensor:
    """(count,) the number of each case's likeliest candidate; those of a case follow each other."""
    sizes = torch.bincount(case, minlength=count).tolist()
    starts = torch.tensor([0, *sizes[:-1]]).cumsum(0)
    chosen = [int(part.argmax()) for part in torch.split(logits.detach(), sizes)]
    return starts + torch.tensor(chosen)


def _logsumexp(x: Tensor, case: Tensor, count: int) -> Tensor:
    top = x.detach().new_full((count,), -1e9).scatter_reduce(0, case, x.detach(), "amax")
    return top + x.new_zeros(count).index_add(0, case, (x - top[case]).exp()).log()


def fit(network: VerificationNetwork, cases: Cases, config: VerificationTraining) -> dict[str, float]:
    """Train the network in place; returns what it reaches on the cases that were kept apart."""
    rng = np.random.default_rng(config.seed)
    torch.manual_seed(config.seed)
    known = np.unique(cases.case)
    held = set(known[-max(1, round(config.held * len(known))) :].tolist())
    train, test = _Grouped(cases, set(known.tolist()) - held), _Grouped(cases, held)
    optimizer = torch.optim.AdamW(
        network.parameters(), lr=config.learning_rate, weight_decay=config.weight_decay
    )
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, config.learning_rate, config.steps)
    network.train()
    for _ in range(config.steps):
        inputs, off, case = train.take(rng.integers(len(train.ranges), size=config.batch))
        dropped = torch.rand_like(inputs) < config.dropout
        inputs = torch.where(dropped, network.standardized.mean, inputs)
        optimizer.zero_grad()
        torch.autograd.backward(loss(network(inputs), off, case))
        optimizer.step()
        schedule.step()
    network.eval()
    return {**measure(network, test), "cases": float(len(train.ranges))}


def measure(network: VerificationNetwork, cases: _Grouped) -> dict[str, float]:
    """Of the likeliest candidate of each case: how often right, mean probability, calibration error.

    Returns:
        right: share of cases whose likeliest candidate is right. possible: share with any right one.
        off: how far the likeliest ones that are right are off, in the mean; 1 is just not right.
        calibration: expected calibration error over ten bins of equal size.
    """
    p = network.probability(cases.inputs).numpy()
    best = [a + int(np.argmax(p[a:b])) for a, b in cases.ranges]
    off, sure = cases.off.numpy()[best], p[best]
    hit = (off < 1).astype(float)
    possible = [bool((cases.off[a:b] < 1).any()) for a, b in cases.ranges]
    return {
        "right": float(hit.mean()),
        "possible": float(np.mean(possible)),
        "off": float(off[off < 1].mean()) if hit.any() else 1.0,
        "sure": float(sure.mean()),
        "calibration": calibration_error(sure, hit),
    }


def equal_bins(sure: FloatArray) -> list[NDArray[np.intp]]:
    """Indices of probabilities (N,), the smallest first, in up to ten bins of equal count."""
    bins = np.array_split(np.argsort(sure, kind="stable"), BINS)
    return [b for b in bins if len(b)]


def calibration_error(sure: FloatArray, hit: FloatArray) -> float:
    """Expected calibration error of probabilities (N,) over ten bins of equal count; `hit` (N,) is 0 or 1."""
    gaps = (abs(hit[b].mean() - sure[b].mean()) * len(b) for b in equal_bins(sure))
    return float(sum(gaps) / len(hit))


def main() -> None:
    """Command line."""
    config = tyro.cli(VerificationTraining, description=__doc__)
    model = load_model(config.weights)
    if not config.further:
        model.verification = VerificationNetwork(model.config.verification)
    reached = fit(model.verification, read_cases(*config.cases), config)
    print(", ".join(f"{name} {value:.3f}" for name, value in reached.items()))
    card = json.loads((config.weights / CARD).read_text())
    card["verification"] = {"command": shlex.join(sys.argv), **reached}
    save_model(model, config.out, card)


if __name__ == "__main__":
    main()
