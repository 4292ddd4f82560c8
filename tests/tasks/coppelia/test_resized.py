"""A resized model says of everything what a resized scene of it shows."""

import numpy as np
import pytest

from imop.sim.resize import resize
from imop.sim.world import World, scene_spec
from imop.tasks.coppelia.boxes import model_box
from imop.tasks.coppelia.convert import add_model
from imop.tasks.coppelia.model import Joint, ProximitySensor, Shape
from imop.tasks.coppelia.resized import resized
from imop.tasks.coppelia.sensors import detects
from tests.tasks.coppelia.conftest import TABLE
from tests.tasks.coppelia.test_convert import world_of

CENTRE = np.array([0.25, 0.0, TABLE])


@pytest.fixture(params=[0.8, 1.25])
def pair(request, cupboard_model):
    """A scale, the model and its scene, and both resized."""
    spec = scene_spec()
    before = {body.name for body in spec.worldbody.bodies}
    add_model(spec, cupboard_model)
    new = [body for body in spec.worldbody.bodies if body.name not in before]
    resize(spec, new, request.param, CENTRE)
    larger = resized(cupboard_model, request.param, CENTRE)
    return request.param, cupboard_model, world_of(cupboard_model), larger, World(spec)


def test_scene_and_file_agree_on_every_pose(pair):
    scale, model, world, larger, scene = pair
    for i, o in enumerate(larger.objects):
        assert scene.pose(o.name) == pytest.approx(larger.T_world_moved[i], abs=1e-9)
        p = CENTRE + scale * (world.pose(o.name)[:3, 3] - CENTRE)
        assert scene.pose(o.name)[:3, 3] == pytest.approx(p, abs=1e-9)
    assert model.objects[0].name == larger.objects[0].name


def test_boxes_sensors_and_slides_are_of_the_scenes_size(pair):
    scale, model, world, larger, scene = pair
    for name in model.index:
        low, high = (np.array(end) for end in model_box(world, model, name))
        if isinstance(model[name], Shape | ProximitySensor) and not model[name].model_base:
            assert np.allclose(model_box(scene, larger, name), (scale * low, scale * high), atol=1e-6)
    slide = larger["slide"]
    assert isinstance(slide, Joint)
    assert scene.joint("slide") == pytest.approx(slide.position) == pytest.approx(scale * 0.1)


def test_sensors_detect_what_they_did(pair):
    _, model, world, larger, scene = pair
    for name in ("frame", "drawer", "ball", "waypoint0"):
        assert detects(scene, larger, "inside", name) == detects(world, model, "inside", name)
