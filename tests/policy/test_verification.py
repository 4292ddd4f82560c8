"""Candidates beside their rivals."""

import numpy as np

from imop.policy.verification import rivals
from tests.policy.scenes import TABLE, above, at

GRASP = above(0.1, 0.1, TABLE + 0.05)


def test_rivals_are_elsewhere():
    poses = np.stack([GRASP, at(0.01, 0.0, 0.0) @ GRASP, at(0.05, 0.0, 0.0) @ GRASP])
    np.testing.assert_array_equal(
        rivals(poses), [[False, False, True], [False, False, True], [True, True, False]]
    )
