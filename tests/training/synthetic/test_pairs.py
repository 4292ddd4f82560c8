from itertools import pairwise

import numpy as np
import pytest

from imop.geometry import se3
from imop.geometry.neighbours import nearest
from imop.training.data.shards import Shard
from imop.training.synthetic.families import HELD_OUT, TRAINING
from imop.training.synthetic.generate import GenerateConfig, generate
from imop.training.synthetic.pairs import synthetic_pairs
from imop.training.synthetic.scenes import ProceduralScene, demonstrate
from imop.training.synthetic.stage import Stage, State
from imop.training.synthetic.steps import press
from imop.training.synthetic.takes import right_motions


@pytest.fixture(scope="module")
def pairs():
    return list(synthetic_pairs(3, 24, TRAINING))


def test_the_truth_carries_the_region_onto_the_observed_surface(pairs):
    """What the query shows of the region lies where every right motion says, up to noise and hidden sides."""
    shares = []
    for pair in pairs:
        region = pair.support.points[pair.region]
        for T in pair.T_query_support[:3]:
            distance, _ = nearest(se3.apply(T, region), pair.query.points)
            shares.append(float((distance < 0.02).mean()))
    assert np.median(shares) > 0.7
    assert np.quantile(shares, 0.05) > 0.2


def test_regions_are_parts_of_the_scene(pairs):
    for pair in pairs:
        assert 0 < pair.region.sum() < len(pair.region)
        assert len(pair.T_query_support) >= 1


def test_scenes_really_differ(pairs):
    moved = [se3.translation_distance(pair.T_query_support[0], np.eye(4)) for pair in pairs]
    assert np.median(moved) > 0.05


def test_the_same_seed_gives_the_same_pairs():
    first, second = (list(synthetic_pairs(7, 4, TRAINING)) for _ in range(2))
    for a, b in zip(first, second, strict=True):
        np.testing.assert_array_equal(a.query.points, b.query.points)
        np.testing.assert_array_equal(a.T_query_support, b.T_query_support)


EVERY = TRAINING | HELD_OUT


@pytest.mark.parametrize("name", list(EVERY))
def test_every_family_makes_a_thing_that_fits_on_the_table(name):
    rng = np.random.default_rng(0)
    thing = EVERY[name](rng, rng)
    stage = Stage([thing])
    poses = stage.link_poses(State(np.eye(4)[None]))
    xy, _ = stage.footprint(0, np.eye(3))
    assert np.abs(xy).max() < 0.3 and stage.top(0) - stage.bottom(0) < 0.5
    for hold in (*thing.holds, *thing.pokes, *(m.hold for m in thing.moving)):
        assert (0, hold.link) in poses
        assert 0.0 <= hold.width <= 0.08
    for moving in thing.moving:
        start, end = (stage.link_in_body(0, moving.joint, p) for p in moving.positions)
        assert not np.allclose(start, end)


def test_families_for_testing_only_are_no_training_families():
    assert not set(HELD_OUT) & set(TRAINING) and not set(HELD_OUT.values()) & set(TRAINING.values())
    made_by = {family.__module__ for family in TRAINING.values()}
    assert "imop.training.synthetic.families.held_out" not in made_by


def test_held_out_scenes_have_pairs():
    assert len(list(synthetic_pairs(1, 4, HELD_OUT))) == 4


def test_ropes_lie_otherwise_in_every_scene_and_keep_their_length():
    draw = np.random.default_rng
    thing = HELD_OUT["rope"](draw(0), draw(1))
    scene = ProceduralScene(
        Stage([thing]), (0,), press(Stage([HELD_OUT["rope"](draw(0), draw(1))]), 0, draw(2))
    )
    lies = []
    for seed in range(3):
        poses = scene.stage.link_poses(demonstrate(scene, draw(seed))[0])
        middles = np.stack([poses[0, link][:3, 3] for link in ("body", *thing.bends)])
        assert np.linalg.norm(np.diff(middles, axis=0), axis=1) == pytest.approx(
            np.full(len(thing.bends), 0.02), abs=0.003
        )
        assert np.ptp(middles[:, 2]) < 1e-6
        lies.append(se3.apply(se3.invert(poses[0, "body"]), middles)[-1])
    assert all(np.linalg.norm(a - b) > 0.01 for a, b in pairwise(lies))


@pytest.mark.parametrize("name", list(EVERY))
def test_shape_and_colour_are_drawn_apart(name):
    """The same shape in another colour, and the same thing twice, are what distractors are made of."""

    def solid(shape, color):
        thing = EVERY[name](np.random.default_rng(shape), np.random.default_rng(color))
        model = thing.part.compile()
        return model.geom_size, model.geom_rgba

    (size, paint), (same_size, other_paint), (_, same_paint) = solid(1, 1), solid(1, 2), solid(1, 1)
    np.testing.assert_array_equal(size, same_size)
    np.testing.assert_array_equal(paint, same_paint)
    assert not np.array_equal(paint, other_paint)


def test_symmetric_and_equal_things_have_several_right_motions():
    class TwoCans:
        def __init__(self):
            rng = np.random.default_rng
            self.stage = Stage([TRAINING["can"](rng(1), rng(2)) for _ in range(2)])
            self.kinds = (0, 0)

    scene = TwoCans()
    here = [se3.make(p=(0.1, y, 0.8)) for y in (-0.2, 0.2)]
    there = [se3.make(p=(0.3, y, 0.8)) for y in (-0.1, 0.3)]
    before, now = (scene.stage.link_poses(State(np.stack(poses))) for poses in (here, there))
    motions = right_motions(scene, (0, "body"), [(0, "body")], before, now)
    ends = {tuple(np.round((T @ here[0])[:3, 3], 3)) for T in motions}
    assert ends == {tuple(T[:3, 3]) for T in there}
    assert len(motions) == 2 * len(scene.stage.things[0].symmetry) > 2


def test_generation_goes_on_where_it_stopped(tmp_path):
    generate(GenerateConfig(tmp_path, 3))
    (path,) = tmp_path.iterdir()
    first = path.read_bytes()
    generate(GenerateConfig(tmp_path, 3))
    assert path.read_bytes() == first and len(Shard(path)) == 3
    path.write_bytes(first[:1000])
    generate(GenerateConfig(tmp_path, 3))
    assert len(Shard(path)) == 3


def test_what_an_approach_is_meant_for_goes_with_the_hand_next():
    """Of steps before a grasp, more of the points next to the goal go with the next carry than elsewhere."""
    near_shares, far_shares = [], []
    for pair in synthetic_pairs(5, 16, TRAINING, kinds=("carry", "unpack")):
        if pair.carry is None:
            continue
        T_begin, T_end = pair.carry.T_world_hand
        points = pair.support.points[pair.support.points[:, 2] > pair.support.points[:, 2].min() + 0.01]
        moved = se3.apply(T_end @ se3.invert(T_begin), points)
        went = nearest(moved, pair.carry.after.points)[0][:, 0] < 0.012
        went &= nearest(points, pair.carry.after.points)[0][:, 0] > 0.012
        near = np.linalg.norm(points - T_begin[:3, 3], axis=1) < 0.04
        if near.any() and not near.all():
            near_shares.append(went[near].mean())
            far_shares.append(went[~near].mean())
    assert len(near_shares) >= 4
    assert np.median(near_shares) > 0.5 > 0.1 > np.median(far_shares)
