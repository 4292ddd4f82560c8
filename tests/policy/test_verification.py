"""Candidates beside their rivals."""

import numpy as np
import pytest

from imop.networks.verification import EVIDENCE, INPUTS, RIVALRY
from imop.policy.verification import beside_rivals, rivals
from tests.policy.scenes import TABLE, above, at

GRASP = above(0.1, 0.1, TABLE + 0.05)


def test_rivals_are_elsewhere():
    poses = np.stack([GRASP, at(0.01, 0.0, 0.0) @ GRASP, at(0.05, 0.0, 0.0) @ GRASP])
    np.testing.assert_array_equal(
        rivals(poses), [[False, False, True], [False, False, True], [True, True, False]]
    )


@pytest.mark.parametrize("order", [[0, 1, 2], [2, 0, 1]])
def test_candidates_are_compared_with_the_best_rival_in_any_order(order):
    rng = np.random.default_rng(0)
    evidence = rng.random((3, len(EVIDENCE)))
    goals = np.stack([GRASP, at(0.005, 0.0, 0.0) @ GRASP, at(0.3, 0.0, 0.0) @ GRASP])
    inputs = beside_rivals(evidence[order], goals[order])[np.argsort(order)]
    assert inputs.shape == (3, INPUTS)
    k = EVIDENCE.index("region_exact")
    to_best, to_rival = inputs[:, len(EVIDENCE)], inputs[:, -len(RIVALRY)]
    np.testing.assert_allclose(to_best, evidence[:, k] - evidence[:, k].max())
    best = evidence[:2, k].max()
    np.testing.assert_allclose(to_rival[:2], evidence[:2, k] - evidence[2, k])
    np.testing.assert_allclose(to_rival[2], evidence[2, k] - best)
