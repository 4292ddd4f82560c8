"""What a score answers to: overlap, normals, shades, free space, occlusion, and what is left over."""

import numpy as np
import pytest

from imop.geometry import se3
from imop.geometry.cloud import concatenate
from imop.policy.evidence import Judge, Surface, Template, shades
from imop.policy.region import Region
from tests.policy.scenes import GREEN, RED, at, box, camera, moved

SIZE = (0.08, 0.05, 0.06)
VIEWS = (camera(),)


def template(region):
    return Template(Region(region, np.ones(len(region)), np.zeros((0, 3))), VIEWS)


def judged(region, query, T, views=VIEWS):
    return Judge(template(region), Surface(query, views)).judge(T).score


def test_the_true_motion_explains_everything_and_brings_its_pairs(rng):
    region, T = box(SIZE, RED), at(0.2, 0.1, yaw=1.0)
    query = moved(box(SIZE, RED, seed=1), T)
    judge = Judge(template(region), Surface(query, VIEWS))
    found = judge.judge(T)
    assert found.score > 0.9 and judge.glance(T[None])[0] > 0.85
    pairs = se3.apply(T, found.p_support) - found.p_query
    assert len(pairs) > 500 and np.linalg.norm(pairs, axis=1).max() < 0.015


@pytest.mark.parametrize("wrong", [at(0.03, 0.0), at(0, 0, yaw=0.6), at(0, 0, 1.0)])
def test_other_motions_explain_less(wrong):
    region = box(SIZE, RED)
    assert judged(region, box(SIZE, RED, seed=1), wrong @ at(0, 0, -0.75)) < 0.8
    assert judged(region, box(SIZE, RED, seed=1), np.eye(4)) > 0.9


def test_another_colour_is_another_thing_but_shadow_is_not():
    region = box(SIZE, RED)
    dark = box(SIZE, tuple(0.6 * c for c in RED), seed=1)
    assert judged(region, box(SIZE, GREEN, seed=1), np.eye(4)) < 0.05
    assert judged(region, dark, np.eye(4)) > 0.7


def test_a_larger_box_is_not_a_small_one():
    small, large = box((0.04, 0.04, 0.04), RED), box((0.1, 0.1, 0.04), RED, seed=1)
    corner = se3.make(p=(0.03, 0.03, 0))
    assert judged(small, large, corner) < 0.8 * judged(small, box((0.04, 0.04, 0.04), RED, seed=1), np.eye(4))


def test_a_wall_seen_from_its_other_side_is_almost_as_good_as_from_the_same():
    region = box(SIZE, RED)
    inside_out = type(region)(region.points, region.colors, region.camera, -region.normals)
    same = judged(region, region, np.eye(4))
    assert 0.8 * same < judged(region, inside_out, np.eye(4)) < 0.95 * same


def test_faces_across_each_other_do_not_explain_each_other():
    region = box(SIZE, RED)
    across = type(region)(region.points, region.colors, region.camera, np.roll(region.normals, 1, axis=1))
    assert judged(region, across, np.eye(4)) < 0.05


def test_unseen_space_costs_less_than_empty_space():
    region = box(SIZE, RED)
    nothing = region.select(np.arange(0))
    near, far = np.full((64, 64), 0.5, np.float32), np.full((64, 64), 9.0, np.float32)
    upper = np.array([[0, 0, 1.0]])
    hidden, through = Surface(nothing, (camera(near),)).seen(np.zeros((1, 3)), upper)
    assert hidden.all() and not through.any()
    hidden, through = Surface(nothing, (camera(far),)).seen(np.zeros((1, 3)), upper)
    assert through.all() and not hidden.any()
    half = region.select(region.points[:, 0] < 0)
    assert judged(region, half, np.eye(4), (camera(near),)) > judged(region, half, np.eye(4), (camera(far),))


def test_in_view_counts_what_is_seen_to_be_gone_but_not_what_is_hidden():
    region = box(SIZE, RED)
    half = region.select(region.points[:, 0] < 0)
    near, far = np.full((64, 64), 0.5, np.float32), np.full((64, 64), 9.0, np.float32)
    covered, open_ = (
        Judge(template(region), Surface(half, (camera(depth),))).in_view(np.eye(4)) for depth in (near, far)
    )
    # From above only the top of the missing half is seen to be gone: a sixth of what is explained.
    assert covered > 0.95 and open_ == pytest.approx(1 / (1 + 1 / 5), abs=0.05)


@pytest.mark.parametrize(
    ("point", "normal"),
    [((0, 0, 0), (0, 0, -1)), ((0, 0, 0), (1, 0, 0)), ((5.0, 0, 0), (0, 0, 1)), ((0, 0, 3.0), (0, 0, 1))],
    ids=["turned away", "edge on", "outside the image", "behind the camera"],
)
def test_a_camera_says_nothing_about_what_it_cannot_see(point, normal):
    surface = Surface(box(SIZE, RED), (camera(np.full((64, 64), 9.0, np.float32)),))
    assert surface.seen(np.array([point], dtype=float), np.array([normal], dtype=float))[0].all()


def test_no_measurement_says_nothing():
    surface = Surface(box(SIZE, RED), (camera(np.full((64, 64), np.nan, np.float32)),))
    hidden, through = surface.seen(np.zeros((1, 3)), np.array([[0, 0, 1.0]]))
    assert hidden.all() and not through.any()


def test_an_absent_handle_costs_more_than_its_share_but_absent_surroundings_do_not():
    mug, handle = box(SIZE, RED), box((0.02, 0.02, 0.02), RED, at(0.08, 0.0))
    whole = concatenate([mug, handle])
    views = (camera(np.full((64, 64), 9.0, np.float32)),)

    def lost(region):
        scores = [
            Judge(Template(region, VIEWS), Surface(box(SIZE, RED, seed=1), seen)).judge(np.eye(4)).score
            for seen in ((), views)
        ]
        return scores[0] - scores[1]

    own = lost(Region(whole, np.ones(len(whole)), np.zeros((0, 3)), firm=True))
    beside = lost(Region(mug, np.ones(len(mug)), np.zeros((0, 3)), handle, firm=True))
    assert own > len(handle) / len(whole)
    assert beside < own / 2


def test_empty_query_explains_nothing():
    region = box(SIZE, RED)
    assert judged(region, region.select(np.arange(0)), np.eye(4)) == 0.0


def test_shades_tell_hues_from_brightness():
    red, dark, green = (shades(np.array([c], np.float32))[0] for c in (RED, (0.4, 0.05, 0.05), GREEN))
    assert np.linalg.norm(red - dark) < 0.3 < np.linalg.norm(red - green)
