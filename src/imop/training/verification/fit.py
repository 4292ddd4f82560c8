"""Training of the verification network on cases; ten minutes on a CPU.

imop training verification --cases DIR [DIR ...] --weights FOLDER --out FOLDER
"""

import json
import shlex
import sys
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn import functional as F
from torch.nn.utils.rnn import pad_sequence

from imop.networks.model import BUNDLED, CARD, load_model, save_model
from imop.networks.verification import EVIDENCE, VerificationNetwork
from imop.policy.verification import rivals
from imop.training.verification.cases import Cases, read_cases
from imop.types import FloatArray

PRECISE = 3.0
"""How fast a right candidate is worth less in the choice, the farther it is off."""
NEVER = -1e4
"""Logit of what is no candidate."""
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
        only: evidence that is new to the network; nothing is trained but how this evidence enters it.
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
    only: tuple[str, ...] = ()
    held: float = 0.15
    steps: int = 2000
    batch: int = 64
    learning_rate: float = 2e-3
    weight_decay: float = 0.05
    dropout: float = 0.2
    seed: int = 0


class Grouped:
    """Cases as tensors, by case.

    Args:
        cases: all of them.
        which: numbers of those that are wanted.
    """

    def __init__(self, cases: Cases, which: set[int]) -> None:
        starts = np.flatnonzero(np.diff(cases.case, prepend=-1))
        self._cases = [
            (
                torch.from_numpy(cases.evidence[a:b]),
                torch.from_numpy(rivals(cases.goals[a:b].astype(np.float64))),
                torch.from_numpy(cases.off[a:b]),
            )
            for a, b in zip(starts, [*starts[1:], len(cases.case)], strict=True)
            if int(cases.case[a]) in which
        ]

    def __len__(self) -> int:
        return len(self._cases)

    def take(self, which: Iterable[int]) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Evidence (B, H, |EVIDENCE|), rivals (B, H, H), how far off (B, H), and which are real (B, H)."""
        evidence, rival, off = zip(*(self._cases[i] for i in which), strict=True)
        most = max(len(x) for x in off)
        beside = torch.stack([F.pad(x, (0, most - len(x), 0, most - len(x))) for x in rival])
        real = torch.stack([torch.arange(most) < len(x) for x in off])
        filled, away = (pad_sequence(list(x), batch_first=True) for x in (evidence, off))
        return filled, beside, away, real


def loss(logits: Tensor, off: Tensor, real: Tensor) -> Tensor:
    """Cross entropy of each candidate, and of the choice among those of a case; the mean over cases.

    In the choice a right candidate is worth more, the nearer it is: the loss is the negative logarithm of the
    worth that is expected of a candidate drawn by its probability. The likeliest candidate of each case
    counts once more on its own: its probability is told, and as the largest of many it would be too large.

    Args:
        logits: (B, H).
        off: (B, H) how far the candidate is off; it is right below 1.
        real: (B, H) False for what only fills up a case.
    """
    right = (off < 1) & real
    each = F.binary_cross_entropy_with_logits(logits, right.to(logits), reduction="none")
    single = (each * real).sum(dim=1) / real.sum(dim=1)
    total = logits.masked_fill(~real, NEVER).logsumexp(dim=1)
    good = (logits - PRECISE * off).masked_fill(~right, NEVER).logsumexp(dim=1)
    some = right.any(dim=1)
    choice = torch.where(some, total - good, 0.0).sum() / some.sum().clamp_min(1)
    likeliest = logits.masked_fill(~real, NEVER).argmax(dim=1, keepdim=True)
    return single.mean() + 0.5 * choice + each.gather(1, likeliest).mean()


def fit(network: VerificationNetwork, cases: Cases, config: VerificationTraining) -> dict[str, float]:
    """Train the network in place; returns what it reaches on the cases that were kept apart."""
    rng = np.random.default_rng(config.seed)
    torch.manual_seed(config.seed)
    known = np.unique(cases.case)
    held = set(known[-max(1, round(config.held * len(known))) :].tolist())
    train, test = Grouped(cases, set(known.tolist()) - held), Grouped(cases, held)
    network.train(not config.only)
    entrance = _entrance(network, config.only, cases) if config.only else []
    trained = [parameter for parameter, _ in entrance] or list(network.parameters())
    decay = 0.0 if config.only else config.weight_decay
    optimizer = torch.optim.AdamW(trained, lr=config.learning_rate, weight_decay=decay)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, config.learning_rate, config.steps)
    for _ in range(config.steps):
        evidence, rival, off, real = train.take(rng.integers(len(train), size=config.batch).tolist())
        dropped = torch.rand_like(evidence) < config.dropout
        optimizer.zero_grad()
        opinions = network(torch.where(dropped, torch.nan, evidence), rival, real)
        torch.autograd.backward(torch.stack([loss(logits, off, real) for logits in opinions]).sum())
        for parameter, new in entrance:
            assert parameter.grad is not None
            parameter.grad *= new
        optimizer.step()
        schedule.step()
    network.eval()
    return {**measure(network, test), "cases": float(len(train))}


def _entrance(
    network: VerificationNetwork, names: Collection[str], cases: Cases
) -> list[tuple[nn.Parameter, Tensor]]:
    """The parameters through which evidence of these names enters, each with a mask, 1 where it does.

    What is usual of that evidence is taken from the cases at once.
    """
    new = [i for i, name in enumerate(EVIDENCE) if name in names]
    values = torch.from_numpy(cases.evidence[:, new])
    network.standardized.mean[new] = values.nanmean(dim=0)
    network.standardized.square[new] = values.square().nanmean(dim=0)
    return network.entering(names)


def measure(network: VerificationNetwork, cases: Grouped) -> dict[str, float]:
    """Of the likeliest candidate of each case: how often right, mean probability, calibration error.

    Returns:
        right: share of cases whose likeliest candidate is right. possible: share with any right one.
        off: how far the likeliest ones that are right are off, in the mean; 1 is just not right.
        calibration: expected calibration error over ten bins of equal size.
    """
    best, p_best, possible = [], [], []
    for number in range(len(cases)):
        evidence, rival, away, _ = (x[0] for x in cases.take([number]))
        p = network.probability(evidence, rival)
        best.append(float(away[p.argmax()]))
        p_best.append(float(p.max()))
        possible.append(bool((away < 1).any()))
    off, sure = np.array(best), np.array(p_best)
    hit = (off < 1).astype(float)
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


def train_verification(config: VerificationTraining) -> dict[str, float]:
    """Train, write all networks to a folder, and say what was reached (`fit`)."""
    model = load_model(config.weights)
    if not config.further:
        model.verification = VerificationNetwork(model.config.verification)
    reached = fit(model.verification, read_cases(*config.cases), config)
    card = json.loads((config.weights / CARD).read_text())
    card["verification"] = {"command": shlex.join(sys.argv), **reached}
    save_model(model, config.out, card)
    return reached
