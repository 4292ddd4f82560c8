import itertools

import numpy as np
import pytest

from imop.geometry import se3
from imop.tasks.coppelia.model import Dummy, Model, PathObject
from imop.tasks.rlbench.waypoints import Words, numbered, path_poses, read_words, thing_of


@pytest.mark.parametrize(
    ("extension", "words"),
    [
        ("", Words(False, False, None)),
        ("ignore_collisions;linear", Words(True, True, None)),
        ("close_gripper()", Words(False, False, 0.0)),
        ("open_gripper(); ignore_collisions", Words(True, False, 1.0)),
        ("close_gripper(0.6),ignore_collisions", Words(True, False, 0.6)),
        ("open_gripper(0.1); ignore_collisions", Words(True, False, 0.1)),
        ("ignore_collision;open_gripper();linear", Words(True, True, 1.0)),
    ],
)
def test_words_of_a_waypoint(extension, words):
    assert read_words(extension) == words


def model_of(*names):
    objects = [Dummy(name=name, parent=-1, T_parent_object=np.eye(4)) for name in names]
    return Model(tuple(objects), {})


def test_waypoints_end_at_the_first_missing_number():
    assert numbered(model_of("waypoint1", "waypoint0", "waypoint3", "waypoint2_")) == [
        "waypoint0",
        "waypoint1",
    ]
    assert numbered(model_of("waypoint1")) == []


def arc(degrees, n):
    """A quarter of a hand's width around, turning with it."""
    angles = np.radians(np.linspace(0, degrees, n))
    points = np.stack([se3.make(se3.euler(z=a), (np.sin(a), np.cos(a), 0)) for a in angles])
    return PathObject(name="p", parent=-1, T_parent_object=np.eye(4), T_path_points=points, closed=False)


@pytest.mark.parametrize("degrees", [10, 60, 180])
def test_steps_along_a_curve_end_where_it_ends_and_turn_little(degrees):
    path = arc(degrees, 40)
    poses = path_poses(path)
    assert poses[-1] == pytest.approx(path.T_path_points[-1])
    chain = [path.T_path_points[0], *poses]
    for a, b in itertools.pairwise(chain):
        assert se3.rotation_distance(a, b) < np.radians(31)
        assert se3.translation_distance(a, b) < 0.13


def test_a_waypoint_hangs_on_the_shape_above_it_or_on_the_base(scene):
    assert thing_of(scene.model, "waypoint0") == "drawer"
    assert thing_of(scene.model, "frame") == "cupboard"
