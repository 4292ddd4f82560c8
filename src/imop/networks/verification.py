"""The verification network: how likely is a motion of the region right, by all that speaks for it?

A small perceptron over the numbers that `EVIDENCE` names. They come from clouds, matches and poses alone
(`policy/evidence.py`), so that candidates of every generator and matcher are judged in one currency.
"""

from dataclasses import dataclass

import torch
from torch import Tensor, nn

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


@dataclass(frozen=True)
class VerificationConfig:
    """Shape of the verification network.

    Attributes:
        inputs: numbers per candidate.
        width: of its two hidden layers.
    """

    inputs: int = INPUTS
    width: int = 64


class VerificationNetwork(nn.Module):
    """Evidence -> logit of being right."""

    def __init__(self, config: VerificationConfig):
        super().__init__()
        self.standardized = Standardized(config.inputs)
        self.layers = nn.Sequential(
            nn.Linear(config.inputs, config.width),
            nn.SiLU(),
            nn.Linear(config.width, config.width),
            nn.SiLU(),
            nn.Linear(config.width, 1),
        )

    def forward(self, evidence: Tensor) -> Tensor:
        """Logits (H,) of candidates with evidence (H, INPUTS); NaN where nothing is known."""
        evidence = torch.where(evidence.isnan(), self.standardized.mean, evidence)
        logits: Tensor = self.layers(self.standardized(evidence))[:, 0]
        return logits

    def probability(self, evidence: Tensor) -> Tensor:
        """(H,) of being right."""
        with torch.inference_mode():
            return torch.sigmoid(self(evidence))
