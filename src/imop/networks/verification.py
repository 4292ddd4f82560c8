"""The verification network: how likely is a motion of the region right, by all that speaks for it?

A small perceptron over the numbers that `EVIDENCE` names. They come from clouds, matches and poses alone
(`policy/evidence.py`), so that candidates of every generator and matcher are judged in one currency. Of most
of them it is known which way they speak: who explains more, in colours that agree better, is never less
likely. The network is built so. A free perceptron learned the cases as well, but held candidates that
everything spoke for to be less likely than others, where so much had hardly ever spoken for one.

Each candidate is scored on its own first. Then its scores are set beside the best of all candidates, and
beside the best of its rivals, which act somewhere else: what that is worth is learned as well.
"""

from collections.abc import Collection
from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from imop.networks.blocks import Standardized

WEIGHTINGS = ("region", "near", "firm", "taken", "goal")
"""All points of the region, those next to the gripper, those that stay in place, what the hand takes, and
what stands where it goes."""

EVIDENCE = (
    *(
        f"{weighting}_{name}"
        for weighting in WEIGHTINGS
        for name in ("exact", "loose", "color", "clash", "hidden", "absent")
    ),
    *(f"context_{name}" for name in ("loose", "color", "absent")),
    "pattern",
    "claimed",
    *(f"backward_{name}" for name in ("exact", "color", "clash", "size")),
    *(f"around_{name}" for name in ("forward", "backward")),
    *(f"matches_{name}" for name in ("asked", "sure", "tight", "loose", "near")),
    *("tilt", "rise", "begun", "hint_away", "hint_turn", "gripper_away", "gripper_turn"),
    *("held", "opens", "opening", "size", "points", "certainty", "spread", "near_spread", "turns", "marks"),
    "palette",
    "apart",
    *("wrist", "palm", "fingers"),
    *("turned_exact", "turned_color", "turned_pattern"),
)
"""What is known of a candidate on its own."""
FOR = ("exact", "loose", "color", "tight", "matches_near", "forward", "around_backward", "pattern")
"""Endings of the names of evidence that speaks for a candidate, the more of it there is."""
AGAINST = ("clash", "absent", "claimed", "wrist", "palm", "fingers")
"""The same of what speaks against it. What has neither ending describes the situation, or may mean either."""

# A rival is not farther behind than this, in scores; where there is none, that far.
BEHIND = 8.0


def directions() -> list[int]:
    """(|EVIDENCE|,) 1 for what speaks for a candidate, -1 against it, 0 for what may do either."""
    return [int(name.endswith(FOR)) - int(name.endswith(AGAINST)) for name in EVIDENCE]


@dataclass(frozen=True)
class VerificationConfig:
    """Shape of the verification network.

    Attributes:
        evidence: numbers per candidate.
        width: of the hidden layers.
        situation: of the layers for what may speak either way.
        scores: of each candidate, that are compared.
        members: networks whose probabilities are averaged.
    """

    evidence: int = len(EVIDENCE)
    width: int = 64
    situation: int = 32
    scores: int = 8
    members: int = 3


class VerificationNetwork(nn.Module):
    """Evidence of all candidates of a case -> logit of each being right, by each member."""

    def __init__(self, config: VerificationConfig):
        super().__init__()
        self.standardized = Standardized(config.evidence)
        self.members = nn.ModuleList(_Member(config) for _ in range(config.members))

    def forward(self, evidence: Tensor, rival: Tensor, real: Tensor) -> Tensor:
        """Logits (members, B, H); of what is no candidate, anything.

        Args:
            evidence: (B, H, |EVIDENCE|) of B cases with up to H candidates; NaN where nothing is known.
            rival: (B, H, H) whether the second is a rival of the first.
            real: (B, H) False for what only fills up a case.
        """
        evidence = torch.where(evidence.isnan(), self.standardized.mean, evidence)
        x = torch.zeros_like(evidence)
        x[real] = self.standardized(evidence[real])
        return torch.stack([member(x, rival, real) for member in self.members])

    def entering(self, names: Collection[str]) -> list[tuple[nn.Parameter, Tensor]]:
        """The parameters through which some evidence enters, each with a mask of the same shape, 1 where."""
        found = []
        for member in (m for m in self.members if isinstance(m, _Member)):
            for parameter, inputs in member.first():
                wanted = [EVIDENCE[int(i)] in names for i in inputs]
                mask = torch.zeros_like(parameter)
                mask[:, : len(wanted)] = torch.tensor(wanted).to(mask)
                found.append((parameter, mask))
        return found

    def probability(self, evidence: Tensor, rival: Tensor) -> Tensor:
        """(H,) of being right, of one case's candidates with evidence (H, |EVIDENCE|) and rivals (H, H)."""
        real = torch.ones(1, len(evidence), dtype=torch.bool)
        with torch.inference_mode():
            return torch.sigmoid(self(evidence[None], rival[None], real))[:, 0].mean(dim=0)


class _Member(nn.Module):
    """Monotone in what has a direction.

    What has none goes through layers of its own, which shift the hidden units of the others.
    """

    directed: Tensor
    free: Tensor
    signs: Tensor

    def __init__(self, config: VerificationConfig):
        super().__init__()
        between, signs = config.situation, directions()
        directed, free = ([i for i, sign in enumerate(signs) if bool(sign) == has] for has in (True, False))
        self.register_buffer("directed", torch.tensor(directed), persistent=False)
        self.register_buffer("free", torch.tensor(free), persistent=False)
        self.register_buffer("signs", torch.tensor([float(signs[i]) for i in directed]), persistent=False)
        self.situation = nn.Sequential(
            nn.Linear(len(free), between), nn.SiLU(), nn.Linear(between, between), nn.SiLU()
        )
        self.alone = _Monotone(len(directed), config.width, config.scores, between)
        self.beside = _Monotone(len(directed) + 3 * config.scores, config.width, 1, between)

    def first(self) -> list[tuple[nn.Parameter, Tensor]]:
        """The weights (W, I) of each first layer, with the columns of the evidence that come first in I."""
        entry = self.situation[0].weight
        assert isinstance(entry, nn.Parameter)
        known = ((layers.weights[0], self.directed) for layers in (self.alone, self.beside))
        return [(entry, self.free), *known]

    def forward(self, x: Tensor, rival: Tensor, real: Tensor) -> Tensor:
        """Logits (B, H) of standardized evidence (B, H, |EVIDENCE|)."""
        situation, known = self.situation(x[..., self.free]), x[..., self.directed] * self.signs
        scores = self.alone(known, situation)
        best = torch.where(real[..., None], scores, -torch.inf).amax(dim=1, keepdim=True)
        others = torch.where((rival & real[:, None])[..., None], scores[:, None], -torch.inf)
        ahead = (scores - others.amax(dim=2)).clamp(-BEHIND, BEHIND)
        logits: Tensor = self.beside(torch.cat([known, scores, scores - best, ahead], dim=-1), situation)
        return logits[..., 0]


class _Monotone(nn.Module):
    """Three layers that grow with every input; what shifts them may do as it likes."""

    def __init__(self, inputs: int, width: int, outputs: int, situation: int) -> None:
        super().__init__()
        shapes = (width, inputs), (width, width), (outputs, width)
        self.weights = nn.ParameterList(torch.randn(shape) / shape[1] for shape in shapes)
        self.shifts = nn.ModuleList(nn.Linear(situation, out) for out, _ in shapes)

    def forward(self, h: Tensor, situation: Tensor) -> Tensor:
        """(..., outputs) of inputs (..., inputs) and (..., situation)."""
        for number, (weight, shift) in enumerate(zip(self.weights, self.shifts, strict=True)):
            h = _bent(h) if number else h
            h = F.linear(h, weight.abs()) + shift(situation)
        return h


def _bent(x: Tensor) -> Tensor:
    """Half of the units (..., W) saturate below, half above: sums of one kind are convex, or concave."""
    below, above = x.chunk(2, dim=-1)
    return torch.cat([F.elu(below), -F.elu(-above)], dim=-1)
