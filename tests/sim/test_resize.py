"""Resized bodies are the same ones in another unit of length."""

import numpy as np
import pytest

from imop.sim.parts.button import STROKE, spring_button
from imop.sim.parts.cup import CupShape, cup
from imop.sim.parts.shapes import add_to
from imop.sim.resize import resize
from imop.sim.world import World, scene_spec

CUP = CupShape(radius=0.04, height=0.09, taper=0.8, reach=0.03)
PLACE = (0.2, -0.1, 0.8)


def scene(scale, centre=(0.0, 0.0, 0.0)):
    """A cup of meshes and capsules, and a button with slides, springs and an invisible needle."""
    spec = scene_spec()
    add_to(spec, "cup", cup(CUP, (1, 0, 0)))
    add_to(spec, "button", spring_button(0.02, (1, 0, 0), (0, 0, 0)))
    spec.body("cup/body").pos = PLACE
    resize(spec, [spec.body("cup/body"), spec.body("button/body")], scale, centre)
    return World(spec)


def own(world):
    m = world.model
    return np.array([m.body(i).name.startswith(("cup", "button")) for i in range(m.nbody)])


@pytest.mark.parametrize("scale", [0.7, 1.0, 1.3])
def test_lengths_scale_and_masses_go_with_the_volume(scale):
    a, b = scene(1.0), scene(scale)
    bodies, geoms = own(a), own(a)[a.model.geom_bodyid]
    assert np.allclose(b.data.geom_xpos[geoms], scale * a.data.geom_xpos[geoms], atol=1e-9)
    assert np.allclose(b.model.geom_rbound[geoms], scale * a.model.geom_rbound[geoms])
    assert np.allclose(b.model.body_mass[bodies], scale**3 * a.model.body_mass[bodies])
    assert np.allclose(b.model.body_inertia[bodies], scale**5 * a.model.body_inertia[bodies])
    assert b.model.joint("button/cap").range[1] == pytest.approx(scale * STROKE)
    assert np.array_equal(b.model.geom_size[~geoms], a.model.geom_size[~geoms])


def test_a_point_stays():
    p = np.array([0.0, 0.0, 0.75])
    moved = scene(2.0, p).pose("cup/body")[:3, 3]
    assert np.allclose(moved, p + 2 * (np.array(PLACE) - p))
