import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from imop.geometry import se3
from imop.importing.tf import TransformTree

STAMPS = np.linspace(0.0, 2.0, 5)


def pose(rng):
    return se3.make(Rotation.random(random_state=int(rng.integers(1000))).as_matrix(), rng.normal(size=3))


@pytest.fixture
def tree(rng):
    tree = TransformTree()
    tree.add("map", "/base", 0.0, pose(rng), True)
    for stamp in (0.0, 1.0, 2.0):
        tree.add("base", "hand", stamp, pose(rng), False)
    tree.add("hand", "tip", 0.0, pose(rng), True)
    tree.add("map", "camera", 0.0, pose(rng), True)
    return tree


@pytest.mark.parametrize(
    ("a", "b", "c"), [("map", "base", "tip"), ("tip", "camera", "hand"), ("hand", "map", "tip")]
)
def test_ways_can_be_joined_and_turned_round(tree, a, b, c):
    there = tree.lookup(a, b, STAMPS) @ tree.lookup(b, c, STAMPS)
    np.testing.assert_allclose(there, tree.lookup(a, c, STAMPS), atol=1e-9)
    np.testing.assert_allclose(se3.invert(tree.lookup(a, b, STAMPS)), tree.lookup(b, a, STAMPS), atol=1e-9)


def test_between_stamps_a_frame_is_between_its_poses():
    tree = TransformTree()
    tree.add("base", "hand", 1.0, np.eye(4), False)
    tree.add("base", "hand", 3.0, se3.make(se3.euler(z=1.0), (2.0, 0.0, 0.0)), False)
    np.testing.assert_allclose(
        tree.lookup("base", "hand", np.array([2.0]))[0], se3.make(se3.euler(z=0.5), (1.0, 0, 0)), atol=1e-9
    )
    np.testing.assert_allclose(tree.lookup("base", "hand", np.array([0.0]))[0], np.eye(4), atol=1e-9)
    assert tree.span("base", "hand") == (1.0, 3.0)


def test_what_moves_and_what_is_connected(tree):
    tree.add("island", "palm", 0.0, np.eye(4), True)
    assert tree.moves("map", "tip") and not tree.moves("map", "camera")
    assert tree.connects("camera", "tip") and not tree.connects("camera", "palm")
    assert tree.roots == ["island", "map"]
