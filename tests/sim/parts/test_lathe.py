import mujoco
import numpy as np
import pytest

from imop.errors import InvalidInput
from imop.sim.parts import lathe
from imop.sim.parts.shapes import part

DENSITY = 1000.0


def compiled_shell(profile, thickness, segments=24):
    spec, body = part()
    lathe.shell(spec, body, "wall", profile, thickness, (1, 1, 1), DENSITY, segments)
    return spec.compile()


def first_hit(model, start, direction):
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    geom = np.zeros(1, dtype=np.int32)
    return mujoco.mj_ray(model, data, np.array(start), np.array(direction), None, 1, -1, geom)


@pytest.mark.parametrize("profile", [[(0.1, 0.0), (0.1, 0.2)], [(0.06, 0.0), (0.09, 0.1), (0.07, 0.15)]])
def test_a_shell_has_the_mass_of_the_surface_of_revolution(profile):
    thickness, segments = 0.005, 48
    p = np.array(profile)
    heights, radii = np.diff(p[:, 1]), p[:, 0]
    outer = np.pi * heights * (radii[1:] ** 2 + radii[1:] * radii[:-1] + radii[:-1] ** 2) / 3
    inner_radii = radii - thickness
    inner = (
        np.pi
        * heights
        * (inner_radii[1:] ** 2 + inner_radii[1:] * inner_radii[:-1] + inner_radii[:-1] ** 2)
        / 3
    )
    mass = compiled_shell(profile, thickness, segments).body_mass.sum()
    assert mass == pytest.approx(DENSITY * (outer - inner).sum(), rel=0.01)


def test_a_shell_is_closed_all_around_and_open_on_top():
    model = compiled_shell([(0.05, 0.0), (0.08, 0.1)], 0.004)
    radius_at_half = 0.065
    for angle in np.linspace(0, 2 * np.pi, 37):
        outward = [np.cos(angle), np.sin(angle), 0.0]
        assert first_hit(model, [0, 0, 0.05], outward) == pytest.approx(radius_at_half - 0.004, abs=0.001)
    assert first_hit(model, [0, 0, 0.05], [0.0, 0.0, 1.0]) == -1


def test_a_solid_has_the_volume_of_its_cone():
    spec, body = part()
    lathe.solid(spec, body, "cone", [(0.05, 0.0), (0.0, 0.09)], (1, 1, 1), DENSITY, segments=64)
    assert spec.compile().body_mass.sum() == pytest.approx(DENSITY * np.pi * 0.05**2 * 0.09 / 3, rel=0.01)


@pytest.mark.parametrize("profile", [[(0.05, 0.0)], [(-0.05, 0.0), (0.05, 0.1)], [(0.003, 0.0), (0.05, 0.1)]])
def test_a_profile_that_cannot_be_turned_is_named(profile):
    with pytest.raises(InvalidInput, match="profile"):
        compiled_shell(profile, 0.004)
