"""How far to trust the best of several hypotheses."""

from collections.abc import Sequence

import numpy as np

from imop.geometry import se3
from imop.policy.matcher import Hypothesis
from imop.types import FloatArray


def confidence(
    hypotheses: Sequence[Hypothesis],
    T_support_gripper: FloatArray,
    distance: float = 0.02,
    angle: float = 0.26,
) -> float:
    """How far to trust the first hypothesis, 0 .. 1: its probability, if it has one, or else its score.

    The score counts less if a rival explains the scene as well.

    A rival only counts if it would send the gripper to another place (`distance`, metres) or from another
    direction (`angle`, radians). A turn about the approach direction alone does not count: that the scene
    looks the same after it means that the object is symmetric.
    """
    if not hypotheses:
        return 0.0
    if hypotheses[0].probability is not None:
        return hypotheses[0].probability
    T = np.stack([h.T_query_support for h in hypotheses]) @ T_support_gripper
    away = se3.translation_distance(T, T[0]) > distance
    lean = np.arccos(np.clip(T[:, :3, 2] @ T[0, :3, 2], -1.0, 1.0)) > angle
    scores = np.array([h.score for h in hypotheses])
    best, rival = scores[0], scores[away | lean].max(initial=0.0)
    margin = np.clip((best - rival) / max(0.2 * best, 1e-9), 0.0, 1.0)
    return float(np.clip(best * (0.4 + 0.6 * margin), 0.0, 1.0))
