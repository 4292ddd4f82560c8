"""Random composites and mechanisms: what holds for every draw."""

import numpy as np
import pytest

from imop.geometry import se3
from imop.geometry.neighbours import nearest
from imop.training.synthetic.families import TRAINING
from imop.training.synthetic.families.composites import glued, set_down, stands
from imop.training.synthetic.families.primitives import ambiguous, disc, mirrored, slab
from imop.training.synthetic.pairs import synthetic_pairs
from imop.training.synthetic.stage import Stage, State

RANDOM = ("composite", "mechanism")
SEEDS = range(3)


def thing(name, shape, color=0):
    return TRAINING[name](np.random.default_rng(shape), np.random.default_rng(color))


def geometry(part):
    model = part.compile()
    return [model.geom_type, model.geom_size, model.geom_pos, model.body_pos, model.body_quat, model.jnt_axis]


def inside(stage):
    """(N, 3) points in the boxes around the parts of a stage's first thing, joints at 0."""
    level, _ = stage.footprint(0, np.eye(3))
    upright, _ = stage.footprint(0, se3.euler(x=-np.pi / 2))
    return np.column_stack([level, upright[:, 1]])


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("name", RANDOM)
def test_the_shape_depends_on_its_own_seed_only(name, seed):
    first, again, other = (thing(name, seed, color) for color in (0, 0, 1))
    for a, b, c in zip(*(geometry(each.part) for each in (first, again, other)), strict=True):
        np.testing.assert_array_equal(a, b)
        np.testing.assert_array_equal(a, c)
    np.testing.assert_array_equal(first.part.compile().geom_rgba, again.part.compile().geom_rgba)
    assert len(first.holds) == len(other.holds) and len(first.moving) == len(other.moving)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_composite_is_as_large_as_what_a_hand_takes_and_stands_on_the_table(seed):
    made = thing("composite", seed)
    points = inside(Stage([made]))
    assert 0.045 < np.ptp(points, axis=0).max() < 0.3
    assert abs(points[:, 2].min()) < 0.02
    assert 1 <= len(made.holds) <= 4
    assert made.symmetry.shape == (1, 4, 4)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("name", RANDOM)
def test_fingers_close_on_the_thing_from_above_or_aside(name, seed):
    made = thing(name, seed)
    stage = Stage([made])
    poses = stage.link_poses(State(np.eye(4)[None]))
    points = inside(stage)
    for hold in (*made.holds, *(moving.hold for moving in made.moving)):
        assert 0.0 <= hold.width <= 0.08
        T = se3.invert(poses[0, "body"]) @ poses[0, hold.link] @ hold.T_link_gripper
        line = se3.apply(T, np.array([(0, y, 0) for y in np.linspace(-0.5, 0.5, 9) * hold.width]))
        assert nearest(line, points)[0].min() < 0.012
        assert T[2, 2] <= 0.2 and T[2, 3] > 0.0


@pytest.mark.parametrize("seed", SEEDS)
def test_what_moves_is_seen_to_move_and_stays_above_the_table(seed):
    made = thing("mechanism", seed)
    stage = Stage([made])
    assert 1 <= len(stage.links[0]) - 1 <= 3
    assert {moving.joint for moving in made.moving} == set(stage.links[0]) - {"body"}
    for moving in made.moving:
        start, end = (
            stage.link_in_body(0, moving.joint, position) @ moving.hold.T_link_gripper
            for position in moving.positions
        )
        assert se3.translation_distance(start, end) > 0.005 or se3.rotation_distance(start, end) > 0.3
        assert min(start[2, 3], end[2, 3]) > 0.0
        assert moving.push == (moving.hold.width == 0.0)


@pytest.mark.parametrize("name", RANDOM)
def test_draws_differ(name):
    sizes = {tuple(np.ptp(inside(Stage([thing(name, seed)])), axis=0).round(3)) for seed in SEEDS}
    assert len(sizes) == len(SEEDS)


def test_pairs_come_of_scenes_of_them_alone():
    pairs = list(synthetic_pairs(2, 4, {name: TRAINING[name] for name in RANDOM}))
    assert len(pairs) == 4 and all(pair.region.any() for pair in pairs)


def test_turns_that_change_nothing_are_noticed():
    bar = slab((-0.06, -0.02, 0), (0.06, 0.02, 0.02))
    knob = disc(0.012, 0.02, 0.05)
    off = knob.moved(se3.make(p=(0.04, 0.005, 0)))
    assert ambiguous(bar.points())
    assert ambiguous(np.concatenate([bar.points(), knob.points()]))
    assert not ambiguous(np.concatenate([bar.points(), off.points()]))


def test_a_mirror_image_of_a_mirror_image_is_the_thing_itself():
    rng = np.random.default_rng(0)
    piece = disc(0.01, 0, 0.05, 0.02).moved(se3.make(se3.euler(x=0.4, y=0.2, z=1.0), (0.1, 0.05, 0.02)))
    T = piece.T @ se3.make(se3.euler(z=rng.uniform(-3, 3)))
    np.testing.assert_allclose(mirrored(mirrored(T)), T)
    assert np.linalg.det(mirrored(T)[:3, :3]) == pytest.approx(1.0)
    flipped = piece.points() * (1, -1, 1)
    assert nearest(piece.mirrored().points(), flipped)[0].max() < 1e-9


def test_things_set_down_stand_at_height_zero():
    rng, stood = np.random.default_rng(0), 0
    for _ in range(20):
        pieces = set_down(rng, glued(rng))
        if pieces:
            points = np.concatenate([piece.points() for piece in pieces])
            assert stands(points) and points[:, 2].min() == pytest.approx(0.0)
            stood += 1
    assert stood > 5


def test_a_bottle_whose_shoulders_are_high_still_has_a_neck():
    sizes = [
        TRAINING["bottle"](np.random.default_rng(shape), np.random.default_rng(0)).part.compile().geom_size
        for shape in (2546904560, *range(200))
    ]
    assert min(size[:, 1].min() for size in sizes) > 0
