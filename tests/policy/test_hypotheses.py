"""Confidence: the score, less where a rival explains the scene as well."""

import numpy as np
import pytest

from imop.geometry import se3
from imop.policy.hypotheses import confidence
from imop.policy.matcher import Hypothesis


def hypothesis(T, score):
    return Hypothesis(T, score, np.zeros((0, 3)), np.zeros((0, 3)))


def test_rival_elsewhere_lowers_confidence():
    T = se3.make(p=(0.3, 0, 1.0))
    alone = confidence([hypothesis(np.eye(4), 0.9)], T)
    rivalled = confidence([hypothesis(np.eye(4), 0.9), hypothesis(se3.make(p=(0.2, 0, 0)), 0.89)], T)
    weak = confidence([hypothesis(np.eye(4), 0.9), hypothesis(se3.make(p=(0.2, 0, 0)), 0.3)], T)
    assert alone == pytest.approx(0.9) and weak == pytest.approx(0.9) and rivalled < 0.5
    assert confidence([], T) == 0.0


def test_symmetric_object_keeps_its_confidence(rng):
    center = np.array([0.2, 0.1, 0.0])
    T_world_gripper = se3.make(np.diag([1.0, -1, -1]), center + np.array([0, 0, 0.1]))
    turns = [se3.make(se3.euler(z=a), center - se3.euler(z=a) @ center) for a in (0.0, 1.0, 3.0)]
    assert confidence([hypothesis(T, 0.9) for T in turns], T_world_gripper) == pytest.approx(0.9)
