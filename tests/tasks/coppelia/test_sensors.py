import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linprog

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.tasks.coppelia.model import ProximitySensor
from imop.tasks.coppelia.placing import place
from imop.tasks.coppelia.reader import read_model
from imop.tasks.coppelia.sensors import Volume, detects, intersects, volume
from tests.tasks.coppelia import writer
from tests.tasks.coppelia.test_convert import world_of

BOX = Volume(
    np.array([[-1, -2, 0], [1, -2, 0], [1, 2, 0], [-1, 2, 0]], float),
    np.array([[-1, -2, 3], [1, -2, 3], [1, 2, 3], [-1, 2, 3]], float),
)


def sensor(kind, near, far, offset=0.0):
    frame = {"name": "s", "parent": -1, "T_parent_object": np.eye(4)}
    faces = {"front_faces": True, "back_faces": True}
    return ProximitySensor(kind=kind, offset=offset, range=1.0, near=near, far=far, **faces, **frame)


@pytest.mark.parametrize(
    ("triangle", "met"),
    [
        ([[0, 0, 1], [0.1, 0, 1], [0, 0.1, 1]], True),  # inside
        ([[-9, -9, 1], [9, -9, 1], [0, 20, 1]], True),  # cuts right through, corners outside
        ([[-9, -9, 4], [9, -9, 4], [0, 20, 4]], False),  # above
        ([[1.5, 0, -1], [1.5, 0, 4], [1.4, 1, 1]], False),  # beside
        ([[2.2, 0, 1.5], [0, 4.4, 1.5], [2.2, 4.4, 1.5]], False),  # past an edge, though its box overlaps
        ([[0.9, 0, 1], [5, 0, 1], [5, 1, 1]], True),  # one corner in
    ],
)
def test_surfaces_meet_a_box(triangle, met):
    assert intersects(BOX, np.array([triangle], float))[0] == met


def meets_by_programming(solid, triangle):
    """Is there a common convex combination? A linear programme, slow and independent."""
    a, b = solid.corners, triangle
    equal = np.vstack(
        [np.hstack([a.T, -b.T]), [[1] * len(a) + [0] * 3, [0] * len(a) + [1] * 3]],
    )
    return linprog(np.zeros(len(a) + 3), A_eq=equal, b_eq=[0, 0, 0, 1, 1]).status == 0


@given(
    st.lists(st.floats(-1.5, 1.5).map(lambda x: round(x, 3)), min_size=9, max_size=9),
    st.sampled_from(["pyramid", "cylinder"]),
)
def test_meeting_is_having_a_point_in_common(numbers, kind):
    solid = volume(sensor(kind, (0.3, 0.2), (0.8, 0.5), 0.1))
    triangle = np.array(numbers).reshape(3, 3)
    assert bool(intersects(solid, triangle[None])[0]) == meets_by_programming(solid, triangle)


def test_volumes_begin_at_their_offset_and_widen():
    corners = volume(sensor("pyramid", (0.1, 0.2), (0.3, 0.4), 0.5)).corners
    assert corners[:, 2].min() == 0.5 and corners[:, 2].max() == 1.5
    assert np.abs(corners[corners[:, 2] < 1]).max(axis=0)[:2] == pytest.approx([0.1, 0.2])
    assert np.abs(corners[corners[:, 2] > 1]).max(axis=0)[:2] == pytest.approx([0.3, 0.4])


def test_a_shape_is_detected_where_its_surface_is(cupboard_model):
    world = world_of(cupboard_model)
    T = world.pose("inside")
    for offset, seen in (((0, 0, 0.04), False), ((0, 0, 0.12), True), ((0, 0, 0.2), False)):
        place(world, cupboard_model, "ball", T @ se3.make(p=offset))
        # The ball is a cube of 10 cm; within 5 cm of its centre there is no surface.
        assert detects(world, cupboard_model, "inside", "ball") is seen


def test_the_volume_moves_with_its_parent(cupboard_model):
    world = world_of(cupboard_model)
    place(world, cupboard_model, "ball", world.pose("inside") @ se3.make(p=(0, 0, 0.12)))
    world.set_joint("slide", 0.3)
    assert not detects(world, cupboard_model, "inside", "ball")


def test_a_dummy_is_detected_where_its_origin_is(cupboard_model):
    world = world_of(cupboard_model)
    T = world.pose("inside")
    lower, upper = volume(cupboard_model["inside"]).corners[[0, -1], 2]
    for z in (lower - 0.002, lower + 0.002, upper - 0.002, upper + 0.002):
        place(world, cupboard_model, "waypoint0", T @ se3.make(p=(0, 0, z)))
        assert detects(world, cupboard_model, "inside", "waypoint0") is bool(lower < z < upper)
    place(world, cupboard_model, "waypoint0", T @ se3.make(p=(0.1, 0, (lower + upper) / 2)))
    assert not detects(world, cupboard_model, "inside", "waypoint0")


def test_only_sensors_detect_and_neither_joints_nor_sensors_are_detected(cupboard_model):
    world = world_of(cupboard_model)
    with pytest.raises(InvalidInput, match="proximity sensor"):
        detects(world, cupboard_model, "frame", "ball")
    for name in ("slide", "inside"):
        with pytest.raises(InvalidInput, match="shape or a dummy"):
            detects(world, cupboard_model, "inside", name)


def test_one_sided_sensors_see_what_looks_towards_them():
    def file(flag):
        box = writer.sensor("eye", 2, -1, sizes=(0, 0.2, 0.1, 0.1, 0.1, 0.1, 0, 0, 0))
        box = box.replace(writer.item("Pr4", b"\0"), writer.item("Pr4", bytes([flag])))
        flat = (np.array([[-1, -1, 0], [1, -1, 0], [0, 1, 0]]), [[0, 1, 2]])
        sheet = writer.shape("sheet", 1, -1, writer.item("Gst", writer.leaf(primitive=0)), p=(0, 0, 0.1))
        return read_model(writer.ttm(writer.arrays(flat), sheet, box))

    # The sheet looks up, away from the sensor below it.
    for flag, seen in ((0x00, True), (0x10, True), (0x20, False)):
        model = file(flag)
        assert detects(world_of(model), model, "eye", "sheet") is seen
