import mujoco
import numpy as np
import pytest

from imop.sim.cameras import look_at, render_view
from imop.sim.pictures import find_pictures
from imop.sim.world import World, scene_spec

RED, GREEN, BLUE, WHITE = (255, 0, 0), (0, 255, 0), (0, 0, 255), (255, 255, 255)
CHECKS = np.array([[RED, GREEN], [BLUE, WHITE]], np.uint8)
SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
FACES = np.array([[0, 1, 2], [0, 2, 3]], np.int32)


def pictured(spec, vertices=SQUARE, faces=FACES, uv=None, rgba=(1, 1, 1, 1), **pose):
    """A body with a mesh that carries the checks: red, green below, blue, white above."""
    texture = spec.add_texture(name="checks", type=mujoco.mjtTexture.mjTEXTURE_2D, nchannel=3)
    texture.height, texture.width, texture.data = 2, 2, CHECKS.tobytes()
    material = spec.add_material(name="checks")
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "checks"
    uv = vertices[:, :2] if uv is None else uv
    spec.add_mesh(
        name="mesh",
        uservert=vertices.ravel(),
        userface=faces.ravel(),
        usertexcoord=np.ascontiguousarray(uv, np.float32).ravel(),
        userfacetexcoord=faces.ravel(),
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
    )
    body = spec.worldbody.add_body(name="picture", **pose)
    body.add_geom(
        name="picture",
        type=mujoco.mjtGeom.mjGEOM_MESH,
        meshname="mesh",
        material="checks",
        rgba=rgba,
        contype=0,
        conaffinity=0,
    )


def compiled(**options):
    spec = mujoco.MjSpec()
    pictured(spec, **options)
    return spec.compile()


def in_geom_frame(model, points):
    """Points of the mesh as it was given, in the frame that the compiler moved it to."""
    geom = model.geom("picture")
    R = np.zeros(9)
    mujoco.mju_quat2Mat(R, geom.quat)
    return (points - geom.pos) @ R.reshape(3, 3)


@pytest.mark.parametrize(
    ("point", "color"),
    [((0.2, 0.2), RED), ((0.8, 0.2), GREEN), ((0.2, 0.8), BLUE), ((0.7, 0.9), WHITE), ((0.49, 0.01), RED)],
)
def test_points_have_the_colour_of_the_picture(point, color):
    model = compiled()
    (picture,) = find_pictures(model).values()
    at = in_geom_frame(model, np.array([[*point, 0.0]]))
    normal = in_geom_frame(model, np.array([[0.0, 0, 1]])) - in_geom_frame(model, np.zeros((1, 3)))
    assert picture.colors(at, normal)[0] == pytest.approx(np.array(color) / 255)


def test_coordinates_beyond_the_picture_repeat_it():
    model = compiled(uv=SQUARE[:, :2] + 3)
    (picture,) = find_pictures(model).values()
    at = in_geom_frame(model, np.array([[0.8, 0.2, 0.0]]))
    assert picture.colors(at, np.zeros((1, 3)))[0] == pytest.approx(np.array(GREEN) / 255)


def test_the_sides_of_a_thin_sheet_differ():
    sides = np.concatenate([SQUARE, SQUARE + np.array([0, 0, 1e-4])]).astype(np.float32)
    faces = np.concatenate([FACES[:, ::-1], FACES + 4])
    uv = np.repeat([[0.25, 0.25], [0.75, 0.75]], 4, axis=0)
    model = compiled(vertices=sides, faces=faces, uv=uv)
    (picture,) = find_pictures(model).values()
    up = in_geom_frame(model, np.array([[0.0, 0, 1]])) - in_geom_frame(model, np.zeros((1, 3)))
    at = in_geom_frame(model, np.array([[0.5, 0.5, 5e-5]]))
    assert picture.colors(at, up)[0] == pytest.approx([1, 1, 1])
    assert picture.colors(at, -up)[0] == pytest.approx([1, 0, 0])


def test_cameras_show_the_picture_tinted():
    spec = scene_spec()
    pictured(spec, rgba=(1.0, 1.0, 0.0, 1.0), pos=[0.0, -0.5, 1.2])
    image = render_view(World(spec), look_at((0.5, 0.0, 3.0), (0.5, 0.001, 1.2), 40), 60, 60).astype(int)
    red, green, blue = image[..., 0], image[..., 1], image[..., 2]
    for one, other in ((red, green), (green, red)):
        assert np.sum((one > 150) & (other < 20) & (blue < 20)) > 100
    assert np.sum((red > 150) & (green > 150) & (blue < 20)) > 100
    # What is blue in the picture is black through a yellow glass.
    assert np.sum(image.sum(axis=2) < 20) > 100


def test_models_without_pictures_have_none():
    assert find_pictures(World(scene_spec()).model) == {}
