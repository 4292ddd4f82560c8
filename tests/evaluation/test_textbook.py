"""FPFH + RANSAC + ICP by Open3D: the baseline finds what is easy."""

import importlib

import numpy as np
import pytest

from imop.errors import MissingExtra
from imop.evaluation import textbook
from imop.geometry import se3
from tests.policy.scenes import RED, TABLE, above, at, box, scene, transitions

HOME = above(0.0, -0.3, 1.2)
GRASP = above(0.1, 0.1, TABLE + 0.05)


def angle(width, depth, height, T):
    """An L of two boxes, which only one motion carries onto itself."""
    return [
        box((width, depth, height), RED, T @ at(0, 0, 0.0), seed=1),
        box((depth, 0.6 * width, 2 * height), RED, T @ at(0.5 * width, 0.4 * width, 0.0), seed=2),
    ]


@pytest.fixture
def prepared():
    pytest.importorskip("open3d", exc_type=ImportError, reason="Open3D (extra baselines) is missing")
    scenes = [scene(angle(0.16, 0.05, 0.05, at(0.1, 0.1)), T) for T in (HOME, GRASP)]
    return textbook.TextbookMatcher().prepare(transitions(scenes, [(GRASP, False)]))[0]


def test_a_thing_without_symmetry_is_found(prepared):
    T = at(0.25, -0.15, yaw=0.8)
    (found,) = prepared.locate(scene(angle(0.16, 0.05, 0.05, T), HOME))
    truth = T @ se3.invert(at(0.1, 0.1))
    assert se3.translation_distance(found.T_query_support @ GRASP, truth @ GRASP) < 0.01
    assert found.score > 0.9 and len(found.p_support) == len(found.p_query)


def test_the_same_query_gives_the_same_answer(prepared):
    query = scene(angle(0.16, 0.05, 0.05, at(0.2, -0.1, yaw=-0.5)), HOME)
    first, second = (prepared.locate(query)[0].T_query_support for _ in range(2))
    np.testing.assert_allclose(first, second, atol=1e-6)


def test_a_query_without_points_gives_no_candidate(prepared):
    query = scene([], HOME)
    assert prepared.locate(type(query)(query.observation, query.cloud.select(np.arange(0)))) == ()


def test_without_open3d_the_extra_is_named(monkeypatch):
    def missing(name, *args, **kwargs):
        if name == "open3d":
            raise ImportError("libGL.so.1")
        return original(name, *args, **kwargs)

    original = importlib.__import__
    monkeypatch.setattr("builtins.__import__", missing)
    with pytest.raises(MissingExtra, match="baselines"):
        textbook.TextbookMatcher()
