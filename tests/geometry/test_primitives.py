import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from imop.geometry import primitives

SIZES = st.tuples(*[st.floats(0.02, 0.2)] * 3).map(np.array)


def directions(rng: np.random.Generator, n: int) -> np.ndarray:
    v = rng.normal(size=(n, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def capsule_surface(size: np.ndarray, n: int, rng: np.random.Generator) -> np.ndarray:
    p = directions(rng, n) * size[0]
    p[:, 2] += np.sign(p[:, 2]) * size[1]
    side = directions(rng, n)
    side *= size[0] / np.hypot(side[:, :1], side[:, 1:2])
    side[:, 2] = rng.uniform(-size[1], size[1], n)
    return np.concatenate([p, side])


def cylinder_surface(size: np.ndarray, n: int, rng: np.random.Generator) -> np.ndarray:
    angle = rng.uniform(-np.pi, np.pi, 2 * n)
    radius = size[0] * np.concatenate([np.ones(n), np.sqrt(rng.random(n))])
    z = np.concatenate([rng.uniform(-size[1], size[1], n), rng.choice((-size[1], size[1]), n)])
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1)


def box_surface(size: np.ndarray, n: int, rng: np.random.Generator) -> np.ndarray:
    p = rng.uniform(-size, size, (2 * n, 3))
    axis = rng.integers(0, 3, 2 * n)
    p[np.arange(2 * n), axis] = size[axis] * rng.choice((-1, 1), 2 * n)
    return p


def sphere_surface(size: np.ndarray, n: int, rng: np.random.Generator) -> np.ndarray:
    return directions(rng, 2 * n) * size[0]


SHAPES = {
    "sphere": (primitives.sphere, sphere_surface),
    "capsule": (primitives.capsule, capsule_surface),
    "cylinder": (primitives.cylinder, cylinder_surface),
    "box": (primitives.box, box_surface),
}


@pytest.mark.parametrize("name", SHAPES)
@given(size=SIZES, seed=st.integers(0, 1000))
def test_distance_is_that_to_the_nearest_surface_sample(name, size, seed):
    distance, surface = SHAPES[name]
    rng = np.random.default_rng(seed)
    samples = surface(size, 20_000, rng)
    points = rng.uniform(-0.5, 0.5, (60, 3))
    nearest = cKDTree(samples).query(points)[0]
    found = np.abs(distance(points, size))
    assert np.all(found <= nearest + 1e-9)
    assert np.all(nearest - found < 0.02)
    np.testing.assert_allclose(distance(samples, size), 0, atol=1e-9)


@pytest.mark.parametrize("name", SHAPES)
def test_inside_is_negative(name, rng):
    distance, surface = SHAPES[name]
    size = np.array([0.1, 0.07, 0.05])
    samples = surface(size, 1000, rng)
    assert np.all(distance(0.9 * samples, size) < 0)
    assert np.all(distance(1.1 * samples, size) > 0)
    assert distance(np.zeros((1, 3)), size)[0] < 0


@given(size=SIZES, seed=st.integers(0, 1000))
def test_ellipsoid_is_right_near_its_surface(size, seed):
    u = directions(np.random.default_rng(seed), 100)
    surface = u * size
    normal = surface / size**2
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    for offset in (-1e-4, 0.0, 1e-4):
        np.testing.assert_allclose(primitives.ellipsoid(surface + offset * normal, size), offset, atol=2e-5)


def test_centre_of_an_ellipsoid_is_inside():
    assert primitives.ellipsoid(np.zeros((1, 3)), np.array([0.1, 0.2, 0.3]))[0] == pytest.approx(-0.1)


def test_hull_of_a_boxs_corners_is_the_box(rng):
    size = np.array([0.1, 0.2, 0.3])
    corners = np.array(np.meshgrid(*[(-1, 1)] * 3)).reshape(3, -1).T * size
    planes = primitives.half_spaces(corners)
    assert len(planes) == 6
    points = rng.uniform(-0.4, 0.4, (500, 3))
    exact, hull = primitives.box(points, size), primitives.convex(points, planes)
    np.testing.assert_array_equal(exact < 0, hull < 0)
    np.testing.assert_allclose(hull[exact < 0], exact[exact < 0], atol=1e-9)
    assert np.all(hull <= exact + 1e-9)


def test_the_hull_of_many_faces_is_exact_near_it_and_far_beyond_it(rng):
    vertices = rng.normal(size=(300, 3)) * (0.2, 0.05, 0.03)
    planes = primitives.half_spaces(vertices)
    points = rng.uniform(-0.6, 0.6, (4000, 3))
    everything = (points @ planes[:, :3].T + planes[:, 3]).max(axis=1)
    found = primitives.convex(points, planes)
    near = everything < primitives.FAR
    np.testing.assert_allclose(found[near], everything[near])
    assert np.all(found[~near] >= primitives.FAR) and np.all(found <= everything + 1e-12)
    assert len(planes) > 40 and 50 < near.sum() < 3000
