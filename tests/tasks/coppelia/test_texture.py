import numpy as np
import pytest

from imop.errors import ModelFormatError
from imop.geometry import se3
from imop.tasks.coppelia.model import Texture
from imop.tasks.coppelia.reader import read_model
from imop.tasks.coppelia.texture import TextureUse, coordinates
from tests.tasks.coppelia import writer

NONE = np.zeros((0, 3, 2), np.float32)


def use(mapping, scale=(1.0, 1.0), T=None, corners=NONE):
    return TextureUse(0, mapping, scale, np.eye(4) if T is None else T, corners, False)


def picture(height=10, width=10):
    return Texture("", np.zeros((height, width, 3), np.uint8))


def test_given_corners_win():
    corners = np.ones((1, 3, 2), np.float32)
    found = coordinates(
        use(0, corners=corners), picture(), np.zeros((3, 3), np.float32), np.array([[0, 1, 2]])
    )
    assert found is corners


def test_planes_put_the_picture_around_the_textures_frame():
    corners = np.array([[1, 2, 0], [1.5, 2, 0], [1, 2.5, 0]], np.float32)
    T = se3.make(p=(1.0, 2.0, 0.0))
    uv = coordinates(use(0, (1.0, 0.5), T), picture(5, 10), corners, np.array([[0, 1, 2]]))
    # The picture is half as high as wide, so v runs twice as fast, and twice again by its scale.
    assert uv[0] == pytest.approx(np.array([[0.5, 0.5], [1.0, 0.5], [0.5, 2.5]]))


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_cubes_look_along_the_triangles_normal(axis):
    corners = np.roll(np.array([[0, 0.2, 0.3], [0, 0.4, 0.3], [0, 0.2, 0.5]]), axis, axis=1).astype(
        np.float32
    )
    uv = coordinates(use(3), picture(), corners, np.array([[0, 1, 2]]))
    assert uv[0] == pytest.approx(np.array([[0.7, 0.8], [0.9, 0.8], [0.7, 1.0]]))


@pytest.mark.parametrize("mapping", [1, 2])
def test_no_triangle_goes_around_a_round_thing(mapping):
    angle = np.radians([170, 190, 180])
    corners = np.stack([np.cos(angle), np.sin(angle), [0, 0, 0.1]], axis=1).astype(np.float32)
    uv = coordinates(use(mapping), picture(), corners, np.array([[0, 1, 2]]))
    assert np.ptp(uv[0, :, 0]) == pytest.approx(20 / 360, abs=1e-4)


def test_a_pole_takes_the_mean_of_its_neighbours():
    corners = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32)
    uv = coordinates(use(2), picture(), corners, np.array([[0, 1, 2]]))
    assert uv[0, 2] == pytest.approx([np.mean(uv[0, :2, 0]), 1.0])
    assert uv[0, 0, 1] == pytest.approx(0.5)


def file_with(pixels, number=5, corners=36):
    toj = writer.section(
        writer.item("Tob", writer.ints(number, 0) + writer.floats(1, 1)),
        writer.item("Ftc", writer.floats(*([0.25] * 2 * corners))),
    )
    geometry = writer.item("Gst", writer.leaf(more=(writer.item("Toj", toj),)))
    arrays = writer.arrays(writer.box_mesh())
    return writer.ttm(writer.texture(5, pixels), arrays, writer.shape("s", 1, -1, geometry))


def test_pictures_are_read_with_their_shapes():
    pixels = np.arange(24, dtype=np.uint8).reshape(2, 4, 3)
    model = read_model(file_with(pixels))
    assert np.array_equal(model.textures[5].pixels, pixels)
    assert model["s"].pieces[0].texture == 5
    assert model["s"].pieces[0].uv.shape == (12, 3, 2)


def test_pictures_that_are_not_there_are_left_out():
    piece = read_model(file_with(np.zeros((1, 1, 3), np.uint8), number=6))["s"].pieces[0]
    assert piece.texture is None and piece.uv is None


def test_wrong_sizes_are_refused():
    with pytest.raises(ModelFormatError, match="texture coordinates"):
        read_model(file_with(np.zeros((1, 1, 3), np.uint8), corners=35))
    broken = file_with(np.zeros((2, 2, 3), np.uint8)).replace(writer.ints(5, 2, 2), writer.ints(5, 2, 3))
    with pytest.raises(ModelFormatError, match="bytes of picture"):
        read_model(broken)
