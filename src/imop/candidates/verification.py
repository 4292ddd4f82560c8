"""How likely a candidate is right: evidence, rivals, and the network that learned to weigh them."""

import numpy as np
import torch

from imop.geometry import se3
from imop.networks.verification import EVIDENCE, RIVALRY, VerificationNetwork
from imop.types import BoolArray, FloatArray

# Candidates that take the gripper farther apart than this, metres and radians, are rivals.
ELSEWHERE = (0.02, 0.26)


class Verifier:
    """Probabilities of candidates, all of one step in one scene."""

    def __init__(self, network: VerificationNetwork) -> None:
        self._network = network

    def __call__(self, evidence: FloatArray, goals: FloatArray) -> FloatArray:
        """(H,) probabilities of being right.

        Args:
            evidence: (H, |EVIDENCE|).
            goals: (H, 4, 4) where the candidates take the gripper.
        """
        inputs = torch.from_numpy(beside_rivals(evidence, goals).astype(np.float32))
        return np.asarray(self._network.probability(inputs).double().numpy())


def beside_rivals(evidence: FloatArray, goals: FloatArray) -> FloatArray:
    """(H, INPUTS) the evidence, and how much of it candidates have more than the best and the best rival."""
    column = {name: evidence[:, k] for k, name in enumerate(EVIDENCE)}
    column["color"] = column["firm_loose"] * column["firm_color"]
    compared = np.stack([column[name] for name in RIVALRY], axis=1)
    elsewhere = rivals(goals)
    other = np.where(elsewhere[:, :, None], compared[None], 0.0).max(axis=1)
    return np.concatenate([evidence, compared - compared.max(axis=0), compared - other], axis=1)


def rivals(goals: FloatArray) -> BoolArray:
    """(H, H) True where two poses (H, 4, 4) of the gripper are not about the same."""
    return ~se3.near(goals[:, None], goals[None], *ELSEWHERE)
