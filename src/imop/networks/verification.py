"""The verification network: how likely is a motion of the region right, by all that speaks for it?

A small perceptron over the numbers that `EVIDENCE` names. They come from clouds, matches and poses alone
(`policy/evidence.py`), so that candidates of every generator and matcher are judged in one currency. Of most
of them it is known which way they speak: who explains more, in colours that agree better, is never less
likely. The network is built so. A free perceptron learned the cases as well, but held candidates that
everything spoke for to be less likely than others, where so much had hardly ever spoken for one.
"""

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
    *(f"backward_{name}" for name in ("exact", "color", "clash", "size")),
    *(f"around_{name}" for name in ("forward", "backward")),
    *(f"matches_{name}" for name in ("asked", "sure", "tight", "loose", "near")),
    *("tilt", "rise", "begun", "hint_away", "hint_turn", "gripper_away", "gripper_turn"),
    *("held", "opens", "opening", "size", "points", "certainty", "spread", "near_spread", "turns", "marks"),
    "palette",
    "apart",
    *("wrist", "palm", "fingers"),
)
"""What is known of a candidate on its own."""
RIVALRY = (
    "region_exact",
    "near_loose",
    "firm_loose",
    "taken_loose",
    "goal_loose",
    "matches_loose",
    "pattern",
    "alike",
    "clear",
)
"""What is compared with the best candidate of all, and with the best that acts somewhere else: numbers of the
evidence, what is explained in its colour (`alike`), and what is not contradicted by colours (`clear`)."""
INPUTS = len(EVIDENCE) + 2 * len(RIVALRY)
FOR = ("exact", "loose", "color", "tight", "matches_near", "forward", "around_backward", "pattern")
"""Endings of the names of evidence that speaks for a candidate, the more of it there is."""
AGAINST = ("clash", "absent", "wrist", "palm", "fingers")
"""The same of what speaks against it. What has neither ending describes the situation, or may mean either."""


def directions() -> list[int]:
    """(INPUTS,) 1 for inputs that speak for a candidate, -1 against it, 0 for those that may do either."""
    known = [int(name.endswith(FOR)) - int(name.endswith(AGAINST)) for name in EVIDENCE]
    return known + 2 * len(RIVALRY) * [1]


@dataclass(frozen=True)
class VerificationConfig:
    """Shape of the verification network.

    Attributes:
        inputs: numbers per candidate.
        width: of its two hidden layers.
        situation: of the layers for what may speak either way.
    """

    inputs: int = INPUTS
    width: int = 64
    situation: int = 32


class VerificationNetwork(nn.Module):
    """Evidence -> logit of being right, monotone in what has a direction.

    What has none goes through layers of its own, which shift the hidden units of the others.
    """

    directed: Tensor
    free: Tensor
    signs: Tensor

    def __init__(self, config: VerificationConfig):
        super().__init__()
        self.standardized = Standardized(config.inputs)
        width, between, signs = config.width, config.situation, directions()
        directed, free = ([i for i, sign in enumerate(signs) if bool(sign) == has] for has in (True, False))
        self.register_buffer("directed", torch.tensor(directed), persistent=False)
        self.register_buffer("free", torch.tensor(free), persistent=False)
        self.register_buffer("signs", torch.tensor([float(signs[i]) for i in directed]), persistent=False)
        self.situation = nn.Sequential(
            nn.Linear(len(free), between), nn.SiLU(), nn.Linear(between, between), nn.SiLU()
        )
        self.shifts = nn.ModuleList(nn.Linear(between, out) for out in (width, width, 1))
        shapes = (width, len(directed)), (width, width), (1, width)
        self.weights = nn.ParameterList(torch.randn(shape) / shape[1] ** 0.5 for shape in shapes)

    def forward(self, evidence: Tensor) -> Tensor:
        """Logits (H,) of candidates with evidence (H, INPUTS); NaN where nothing is known."""
        evidence = torch.where(evidence.isnan(), self.standardized.mean, evidence)
        x = self.standardized(evidence)
        situation, h = self.situation(x[:, self.free]), x[:, self.directed] * self.signs
        for number, (weight, shift) in enumerate(zip(self.weights, self.shifts, strict=True)):
            h = _bent(h) if number else h
            h = F.linear(h, weight.abs()) + shift(situation)
        logits: Tensor = h[:, 0]
        return logits

    def probability(self, evidence: Tensor) -> Tensor:
        """(H,) of being right."""
        with torch.inference_mode():
            return torch.sigmoid(self(evidence))


def _bent(x: Tensor) -> Tensor:
    """Half of the units (H, W) saturate below, the others above: sums of one kind are convex, or concave."""
    below, above = x.chunk(2, dim=-1)
    return torch.cat([F.elu(below), -F.elu(-above)], dim=-1)
