import mujoco
import numpy as np
import pytest

from imop.sim.parts import cupboard
from imop.sim.parts.grocery import GROCERIES, grocery
from imop.sim.parts.shapes import add_to


def standing(part, height):
    scene = mujoco.MjSpec()
    scene.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[2, 2, 0.1])
    add_to(scene, "it", part)
    model = scene.compile()
    data = mujoco.MjData(model)
    data.qpos[2] = height
    mujoco.mj_forward(model, data)
    return model, data


@pytest.mark.parametrize("kind", GROCERIES, ids=lambda kind: kind.name)
def test_a_grocery_has_its_size_and_stands(kind):
    model, data = standing(grocery(kind), kind.height)
    lower, upper = np.full(3, np.inf), np.full(3, -np.inf)
    for geom in np.flatnonzero(model.geom_bodyid > 0):
        centre, half = np.split(model.geom_aabb[geom], 2)
        corners = centre + half * (np.indices((2, 2, 2)).reshape(3, -1).T * 2 - 1)
        p = corners @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
        lower, upper = np.minimum(lower, p.min(axis=0)), np.maximum(upper, p.max(axis=0))
    assert upper[0] - lower[0] == pytest.approx(kind.length, abs=0.002)
    assert upper[2] - lower[2] == pytest.approx(kind.height, abs=0.001)
    assert 0.03 < model.body_subtreemass[1] < 0.8
    mujoco.mj_step(model, data, 500)
    assert abs(data.qpos[2] - kind.height) < 0.004 and data.qpos[3] > 0.999


def test_the_shade_changes_the_pack_only():
    plain, dark = (standing(grocery(GROCERIES[0], s), 1.0)[0] for s in ((0, 0, 0), (-0.05, 0, 0)))
    assert not np.allclose(plain.geom_rgba, dark.geom_rgba)
    assert np.allclose(plain.body_subtreemass, dark.body_subtreemass)


def test_the_longest_grocery_fits_into_the_cupboard():
    longest = max(kind.height for kind in GROCERIES)
    assert longest < cupboard.DEPTH and max(kind.length for kind in GROCERIES) < cupboard.HEIGHT
    scene = mujoco.MjSpec()
    add_to(scene, "it", cupboard.open_cupboard(0.3, (1, 1, 1), (1, 1, 1)))
    model = scene.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    start, met = np.array([-0.1, 0, 0.1]), np.zeros(1, dtype=np.int32)
    directions = np.array([(-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1), (1, 0, 0)], dtype=float)
    free = [mujoco.mj_ray(model, data, start, d, None, True, -1, met, None) for d in directions]
    half = 0.15
    assert np.allclose(free, (cupboard.DEPTH - 0.1, half, half, cupboard.HEIGHT - 0.1, 0.1, -1))
