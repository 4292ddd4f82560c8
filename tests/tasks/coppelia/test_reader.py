import numpy as np
import pytest

from imop.errors import ModelFormatError
from imop.geometry import se3
from imop.tasks.coppelia.model import Dummy, Joint, PathObject, ProximitySensor, Shape
from imop.tasks.coppelia.reader import read_model
from tests.tasks.coppelia import writer
from tests.tasks.coppelia.conftest import cupboard


def test_objects_come_parents_first_and_typed(cupboard_model):
    kinds = {o.name: type(o) for o in cupboard_model.objects}
    assert kinds["cupboard"] is kinds["waypoint0"] is Dummy
    assert kinds["slide"] is Joint and kinds["inside"] is ProximitySensor
    assert kinds["frame"] is kinds["drawer"] is Shape
    assert all(o.parent < i for i, o in enumerate(cupboard_model.objects))
    assert cupboard_model["waypoint0"].extension == "open_gripper()"
    assert cupboard_model["cupboard"].model_base


def test_packed_and_plain_files_say_the_same():
    plain, packed = read_model(cupboard()), read_model(cupboard(compress=True))
    assert [o.name for o in plain.objects] == [o.name for o in packed.objects]
    assert np.array_equal(plain.T_world_moved, packed.T_world_moved)


def test_world_poses_go_through_joints(cupboard_model):
    # The frame is half turned, the slide moves up by 0.1, the drawer stands 0.05 above it.
    T = cupboard_model.T_world("drawer")
    assert T[:3, 3] == pytest.approx([0.05, 0, 0.752 + 0.05 + 0.1 + 0.05])
    assert T[:3, :3] == pytest.approx(np.diag([-1, -1, 1]))
    assert cupboard_model.T_world("slide")[2, 3] == pytest.approx(0.802)


def one(*items):
    return read_model(writer.ttm(writer.arrays(writer.box_mesh()), *items))


def test_turning_joints_turn_about_z_and_screws_rise():
    model = one(
        writer.dummy("root", 1),
        writer.joint("j", 2, 1, kind=10, q=0.5),
        writer.dummy("tip", 3, 2, p=(1, 0, 0)),
    )
    assert model.T_world("tip")[:3, 3] == pytest.approx([np.cos(0.5), np.sin(0.5), 0])
    assert model["j"].limits == pytest.approx((0, 0.3))
    cyclic = one(writer.joint("j", 2, -1, kind=10, flags=1))
    assert cyclic["j"].limits is None


@pytest.mark.parametrize(
    ("flags", "motor"), [(0, "off"), (0x10, "velocity"), (0x30, "position"), (0xB0, "spring")]
)
def test_motors(flags, motor):
    assert one(writer.joint("j", 2, -1, flags=flags))["j"].motor == motor


def test_compounds_are_lists_of_pieces_in_the_shapes_frame():
    geometry = writer.item(
        "Gsg",
        writer.wrapper(
            2.0,
            (1, 2, 3),
            writer.item("Geo", writer.leaf(p=(1, 0, 0))),
            writer.item(
                "Wrp",
                writer.wrapper(1, (1, 1, 1), writer.item("Geo", writer.leaf(rgb=(0, 1, 0), p=(2, 0, 0)))),
            ),
        ),
    )
    shape = one(writer.shape("s", 1, -1, geometry))["s"]
    assert [p.color for p in shape.pieces] == [(1, 0, 0), (0, 1, 0)]
    assert shape.corners[..., 0].min() == pytest.approx(0.95)
    assert shape.corners[..., 0].max() == pytest.approx(2.05)
    assert shape.mass == pytest.approx(2)
    assert shape.moments == pytest.approx([2, 4, 6])


def test_compounds_in_compounds_without_end_are_refused():
    geometry = writer.wrapper()
    for _ in range(200):
        geometry = writer.wrapper(1, (1, 1, 1), writer.item("Wrp", geometry))
    with pytest.raises(ModelFormatError, match="compounds"):
        one(writer.shape("s", 1, -1, writer.item("Gsg", geometry)))


def test_a_model_switches_its_parts_off():
    base = (writer.item("Va2", b"\1"), writer.item("Mpo", writer.ints(0x20 | 0x40 | 0x100)))
    root = writer.item("DMY", writer.common("root", 1, more=base) + writer.section())
    shape = one(root, writer.dummy("d", 2, 1), writer.shape("s", 3, 2, dynamic=True))["s"]
    assert not (shape.dynamic or shape.respondable or shape.shown)


@pytest.mark.parametrize(("layer", "shown"), [(1, True), (0x100, False), (0x101, True)])
def test_layers_hide(layer, shown):
    assert one(writer.shape("s", 1, layer=layer))["s"].shown is shown


def test_objects_of_before_layers_are_hidden():
    assert not one(writer.shape("s", 1, properties=0))["s"].shown


def test_sensors_and_paths():
    sensor = one(writer.sensor("s", 1, -1, kind=1, sizes=(0.01, 0.2, 9, 9, 9, 9, 0.03, 0.04, 0)))["s"]
    assert (sensor.kind, sensor.near, sensor.far) == (
        "cylinder",
        pytest.approx((0.03,) * 2),
        pytest.approx((0.04,) * 2),
    )
    path = one(writer.path("p", 1, -1, [(0, 0, 0), (1, 0, 0), (1, 1, 0)]))["p"]
    assert isinstance(path, PathObject) and not path.closed
    assert path.T_path_points[:, :3, 3] == pytest.approx(np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0]]))


@pytest.mark.parametrize("links", [((1, 1),), ((1, 2), (2, 1)), ((1, 3), (2, 1), (3, 2))])
def test_objects_that_are_their_own_ancestors_are_refused(links):
    with pytest.raises(ModelFormatError, match="ancestor"):
        one(*(writer.dummy(f"d{a}", a, b) for a, b in links))


def test_names_and_handles_are_unique():
    for twins in ((("a", 1), ("a", 2)), (("a", 1), ("b", 1))):
        with pytest.raises(ModelFormatError, match="second"):
            one(*(writer.dummy(name, handle) for name, handle in twins))


def test_parents_that_are_not_there_are_none():
    assert one(writer.dummy("d", 1, 99)).objects[0].parent == -1


@pytest.mark.parametrize(
    ("change", "word"),
    [
        (lambda d: d[:500], "header"),
        (lambda d: b"NOPE" + d[4:], "VREP"),
        (lambda d: d[:4] + writer.ints(99) + d[8:], "version"),
        (lambda d: d[:13] + writer.ints(2**31 - 1) + d[17:], "body of"),
        (lambda d: d[:13] + writer.ints(-5) + d[17:], "body of"),
        (lambda d: d[:12] + b"\7" + d[13:], "compression"),
        (lambda d: d[:-1], "body of"),
        (lambda d: d + b"EOF", "body of"),
    ],
)
def test_broken_headers_are_named(cupboard_bytes, change, word):
    with pytest.raises(ModelFormatError, match=word):
        read_model(change(cupboard_bytes))


def test_curves_are_bounded():
    with pytest.raises(ModelFormatError, match="count"):
        one(writer.path("p", 1, -1, [(0, 0, 0)] * 3, bezier=(1, 1, 2**30)))


def test_the_error_says_where_and_what_was_expected():
    data = writer.body(writer.dummy("d", 1).replace(b"Nme", b"Xme"))
    with pytest.raises(ModelFormatError) as error:
        read_model(writer.header(len(data)) + data)
    assert error.value.expected == "an item Nme"
    assert str(error.value.offset) in str(error.value)


def test_moved_frames_agree_with_the_chain_of_poses(cupboard_model):
    frame, slide = cupboard_model["frame"], cupboard_model["slide"]
    root = cupboard_model["cupboard"].T_parent_object
    T = root @ frame.T_parent_object @ slide.T_parent_object @ se3.make(p=(0, 0, 0.1))
    assert cupboard_model.T_world_moved[cupboard_model.index["slide"]] == pytest.approx(T)
