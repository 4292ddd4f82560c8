"""What the evidence answers to: overlap, spread, normals, shades, free space, occlusion, what is left."""

import numpy as np
import pytest

from imop.geometry import se3
from imop.geometry.cloud import concatenate
from imop.networks.verification import EVIDENCE
from imop.policy.evidence import Template, crowd, glance, looks, palette, pattern, shares
from imop.policy.interfaces import PolicyConfig
from imop.policy.region import Goal, Region
from imop.policy.target import OFFSET, Surface, shades
from tests.policy.scenes import BLUE, GREEN, RED, at, box, camera, moved

SIZE = (0.08, 0.05, 0.06)
FAR, NEAR = (np.full((64, 64), depth, np.float32) for depth in (9.0, 0.5))
GOAL = np.array([0.0, 0.0, 0.06])


def region(cloud, spread=0.001, context=None):
    return Region(cloud, np.ones(len(cloud)), np.zeros((0, 3)), context, spread=np.full(len(cloud), spread))


def evidence(cloud, query, T=None, depth=None, spread=0.001, context=None):
    """By name, of one motion."""
    template = Template(region(cloud, spread, context), GOAL, cloud, (camera(),), PolicyConfig())
    motion = (np.eye(4) if T is None else T)[None]
    row = shares(template, Surface(query, (camera(depth),)), motion)[0]
    return dict(zip(EVIDENCE, row, strict=False))


def test_the_true_motion_is_explained_in_all_ways():
    T = at(0.2, 0.1, yaw=1.0)
    found = evidence(box(SIZE, RED), moved(box(SIZE, RED, seed=1), T), T)
    for name in ("region_exact", "near_exact", "firm_exact", "region_color", "backward_exact"):
        assert found[name] > 0.85, name
    assert found["around_forward"] > 0.85 and found["around_backward"] > 0.85
    assert found["region_absent"] == 0


@pytest.mark.parametrize("wrong", [at(0.03, 0.0, 0.0), at(0, 0, 0.0, yaw=0.6), at(0, 0, 0.25)])
def test_other_motions_are_explained_less(wrong):
    cloud = box(SIZE, RED)
    right, other = (evidence(cloud, box(SIZE, RED, seed=1), T, FAR) for T in (np.eye(4), wrong))
    assert other["region_exact"] < 0.9 * right["region_exact"]


def test_a_glance_prefers_the_true_motion_in_every_column():
    cloud, T = box(SIZE, RED), at(0.2, 0.1, yaw=1.0)
    template = Template(region(cloud), GOAL, cloud, (), PolicyConfig())
    looks = glance(template, Surface(moved(cloud, T), ()), np.stack([T, at(0.03, 0.0, 0.0) @ T]))
    assert looks.shape == (2, 6) and (looks[0] > looks[1]).all() and (looks[0] > 0.8).all()


def test_what_may_differ_is_explained_loosely():
    small, large = box(SIZE, RED), box((0.1, 0.07, 0.08), RED, seed=1)
    strict, loose = (evidence(small, large, spread=s) for s in (0.001, 0.02))
    missing = [e["region_hidden"] + e["region_absent"] for e in (strict, loose)]
    assert missing[0] > 0.5 > 0.2 > missing[1] and loose["region_loose"] > 0.7


def test_what_is_firm_counts_where_the_rest_may_differ():
    # The lower half may differ, and does; the upper one may not.
    cloud = box(SIZE, RED)
    upper = cloud.points[:, 2] > 0.03
    spread = np.where(upper, 0.001, 0.05)
    query = cloud.select(upper)
    template = Template(
        Region(cloud, np.ones(len(cloud)), np.zeros((0, 3)), spread=spread),
        GOAL,
        cloud,
        (camera(),),
        PolicyConfig(),
    )
    row = dict(zip(EVIDENCE, shares(template, Surface(query, ()), np.eye(4)[None])[0], strict=False))
    assert row["firm_loose"] + row["firm_hidden"] > 0.95 and row["region_hidden"] > 2 * row["firm_hidden"]


def test_another_colour_is_another_thing_but_shadow_is_not():
    cloud = box(SIZE, RED)
    dark = box(SIZE, tuple(0.6 * c for c in RED), seed=1)
    green, shadow = (evidence(cloud, query) for query in (box(SIZE, GREEN, seed=1), dark))
    assert green["region_exact"] > 0.85 and green["region_color"] < 0.1 < 0.7 < shadow["region_color"]


def test_a_larger_box_is_not_a_small_one():
    small, large = box((0.04, 0.04, 0.04), RED), box((0.1, 0.1, 0.04), RED, seed=1)
    corner = se3.make(p=(0.03, 0.03, 0))
    part, same = evidence(small, large, corner), evidence(small, box((0.04, 0.04, 0.04), RED, seed=1))
    assert part["backward_exact"] < 0.8 * same["backward_exact"]


def test_a_wall_seen_from_its_other_side_is_almost_as_good_as_from_the_same():
    cloud = box(SIZE, RED)
    inside_out = type(cloud)(cloud.points, cloud.colors, cloud.camera, -cloud.normals)
    same, other = evidence(cloud, cloud)["region_exact"], evidence(cloud, inside_out)["region_exact"]
    assert 0.8 * same < other < 0.95 * same


def test_faces_across_each_other_do_not_explain_each_other():
    cloud = box(SIZE, RED)
    across = type(cloud)(cloud.points, cloud.colors, cloud.camera, np.roll(cloud.normals, 1, axis=1))
    assert evidence(cloud, across)["region_exact"] < 0.05


def test_what_is_hidden_is_told_from_what_is_seen_to_be_absent():
    cloud = box(SIZE, RED)
    half = cloud.select(cloud.points[:, 0] < 0)
    hidden, absent = (evidence(cloud, half, depth=depth) for depth in (NEAR, FAR))
    assert hidden["region_exact"] > 0.95 > absent["region_exact"]
    assert hidden["region_hidden"] > 0.3 and hidden["region_absent"] == 0
    # From above only the top of the missing half is seen to be gone.
    assert 0.05 < absent["region_absent"] < 0.3


def test_the_context_has_evidence_of_its_own():
    mug, handle = box(SIZE, RED), box((0.02, 0.02, 0.02), RED, at(0.08, 0.0, 0.0))
    both = concatenate([mug, handle])
    there, gone = (evidence(mug, query, depth=FAR, context=handle) for query in (both, mug))
    assert there["context_loose"] > 0.9 and gone["context_loose"] < 0.1 < gone["context_absent"]
    assert there["region_exact"] == pytest.approx(gone["region_exact"], abs=1e-6)


@pytest.mark.parametrize(
    ("point", "normal"),
    [((0, 0, 0), (0, 0, -1)), ((0, 0, 0), (1, 0, 0)), ((5.0, 0, 0), (0, 0, 1)), ((0, 0, 3.0), (0, 0, 1))],
    ids=["turned away", "edge on", "outside the image", "behind the camera"],
)
def test_a_camera_says_nothing_about_what_it_cannot_see(point, normal):
    surface = Surface(box(SIZE, RED), (camera(FAR),))
    assert surface.seen(np.array([point], dtype=float), np.array([normal], dtype=float))[0].all()


@pytest.mark.parametrize("depth", [np.nan, 0.0])
def test_no_measurement_says_nothing(depth):
    surface = Surface(box(SIZE, RED), (camera(np.full((64, 64), depth, np.float32)),))
    hidden, through = surface.seen(np.zeros((1, 3)), np.array([[0, 0, 1.0]]))
    assert hidden.all() and not through.any()


def test_evidence_moves_with_both_scenes():
    cloud, query = box(SIZE, RED), box(SIZE, RED, seed=1)
    A, B = at(0.1, 0.2, 0.0, yaw=0.5), at(-0.1, 0.1, 0.0, yaw=-1.0)
    goal = se3.apply(A, GOAL[None])[0]
    here = Template(region(cloud), GOAL, cloud, (), PolicyConfig())
    there = Template(region(moved(cloud, A)), goal, moved(cloud, A), (), PolicyConfig())
    T = at(0.01, 0.0, 0.0)
    one = shares(here, Surface(query, ()), T[None])
    other = shares(there, Surface(moved(query, B), ()), (B @ T @ se3.invert(A))[None])
    np.testing.assert_allclose(one, other, atol=1e-6)


def test_shades_tell_hues_from_brightness():
    red, dark, green = (shades(np.array([c], np.float32))[0] for c in (RED, (0.4, 0.05, 0.05), GREEN))
    assert np.linalg.norm(red - dark) < 0.3 < np.linalg.norm(red - green)


def test_exact_is_loose_without_spread():
    cloud = box(SIZE, RED)
    surface = Surface(moved(box(SIZE, RED, seed=1), at(0.004, 0.0, 0.0)), ())
    seen = cloud.points, cloud.normals, shades(cloud.colors)
    found = surface.explain(*seen, np.zeros(len(cloud)))
    np.testing.assert_allclose(found.exact, found.loose)
    more = surface.explain(*seen, np.full(len(cloud), OFFSET))
    assert (more.loose >= more.exact).all()


def marked(color, mark):
    """A box with a mark at one of its ends."""
    return concatenate([box(SIZE, color), box((0.02, 0.05, 0.062), mark, at(0.03, 0.0, 0.0))])


def test_marks_tell_a_turn_whatever_their_colours():
    cloud, turned = marked(RED, GREEN), at(0, 0, 0, yaw=np.pi)
    for query in (marked(RED, GREEN), marked(GREEN, BLUE)):
        right, other = (evidence(cloud, moved(query, T), depth=FAR) for T in (np.eye(4), turned))
        assert right["pattern"] > 0.75 > 0.5 > other["pattern"]


@pytest.mark.parametrize("yaw", [0.0, 1.0, np.pi])
def test_paint_tells_a_turn_before_its_colours_are_known(yaw):
    cloud, query = marked(RED, GREEN), moved(marked(GREEN, BLUE), at(0, 0, 0, yaw=yaw))
    template = Template(region(cloud), GOAL, cloud, (), PolicyConfig())
    turns = np.stack([at(0, 0, 0, yaw=yaw), at(0, 0, 0, yaw=yaw + np.pi)])
    right, other = looks(template, Surface(query, ()), turns)
    assert right[2] > other[2] + 0.2


def test_shape_and_colours_look_right_where_they_are():
    cloud = marked(RED, GREEN)
    template = Template(region(cloud), GOAL, cloud, (), PolicyConfig())
    motions = np.stack([np.eye(4), at(0, 0, 0, yaw=np.pi), at(0.03, 0, 0)])
    right, turned, off = looks(template, Surface(cloud, ()), motions)
    assert right[0] > 0.99 > turned[0] > 0.75 > off[0]
    assert right[1] > 0.99 > 0.8 > turned[1]


def test_what_looks_like_something_else_that_was_shown_is_claimed_by_it():
    cloud = box(SIZE, RED)
    beside = Template(region(cloud), GOAL, cloud, (), PolicyConfig(), others=box(SIZE, GREEN).colors)
    claims = {}
    for color in (RED, GREEN, BLUE):
        row = shares(beside, Surface(box(SIZE, color, seed=1), (camera(),)), np.eye(4)[None])[0]
        claims[color] = dict(zip(EVIDENCE, row, strict=False))["claimed"]
    assert claims[GREEN] > 0.9 and claims[RED] == 0 and claims[BLUE] < 0.1
    assert evidence(cloud, box(SIZE, GREEN, seed=1))["claimed"] == 0


def test_a_contradiction_of_colours_is_seen_though_most_of_them_agree():
    cloud, turned = marked(RED, GREEN), at(0, 0, 0, yaw=np.pi)
    right, other = (evidence(cloud, moved(marked(RED, GREEN), T)) for T in (np.eye(4), turned))
    for name in ("region_clash", "backward_clash"):
        assert right[name] < 0.1 < 0.25 < other[name]
    assert other["region_color"] > 0.4


def test_one_colour_has_no_pattern():
    assert abs(evidence(box(SIZE, RED), box(SIZE, GREEN, seed=1))["pattern"]) < 1e-6


def test_a_pattern_is_any_linear_map_of_colours_but_not_chance(rng):
    shown, weight = rng.random((300, 4)), np.ones((2, 300))
    found = np.stack([shown @ rng.random((4, 4)) + 0.3, rng.random((300, 4))])
    mapped, chance = pattern(shown, found, weight)
    assert mapped > 0.9 and chance < 0.1


def test_colours_are_in_the_palette_of_a_scene_wherever_they_are():
    template = Template(region(marked(RED, GREEN)), GOAL, box(SIZE, RED), (), PolicyConfig())
    red, both = box(SIZE, RED, at(0.5, 0.5)), concatenate([box(SIZE, RED, at(0.5, 0.5)), box(SIZE, GREEN)])
    everywhere, half, nothing = (
        palette(template, Surface(cloud, ())) for cloud in (both, red, box(SIZE, BLUE))
    )
    assert everywhere > 0.99 > 0.9 > half > 0.5 > 0.1 > nothing


def test_the_goal_tells_apart_what_the_region_does_not():
    """Two motions that explain the region, of which one also explains what stands where the hand goes."""
    held, goal = box(SIZE, RED), moved(box(SIZE, BLUE), at(0.2, 0.0, 0.0))
    stands = Goal(goal, np.ones(len(goal)), goal.points)
    template = Template(region(held), GOAL, goal, (camera(),), PolicyConfig(), goal=stands)
    query = concatenate([held, moved(held, at(0.0, 0.3, 0.0)), moved(goal, at(0.0, 0.3, 0.0))])
    rows = shares(template, Surface(query, (camera(FAR),)), np.stack([np.eye(4), at(0.0, 0.3, 0.0)]))
    elsewhere, right = (dict(zip(EVIDENCE, row, strict=False)) for row in rows)
    assert min(elsewhere["region_exact"], right["region_exact"]) > 0.85
    assert right["goal_exact"] > 0.85 > 0.1 > elsewhere["goal_exact"]
    assert elsewhere["goal_absent"] > 0.1 and right["goal_absent"] == 0


def test_the_region_stands_for_a_goal_that_is_not_apart():
    found = evidence(box(SIZE, RED), box(SIZE, RED, seed=1))
    for name in ("exact", "loose", "color", "clash", "hidden", "absent"):
        assert found[f"goal_{name}"] == pytest.approx(found[f"near_{name}"])


def test_what_stands_where_the_hand_would_be_crowds_it_wherever_that_is():
    T = se3.make(se3.euler(0.3, 2.9, 0.4), (0.3, 0.1, 0.2))
    places = np.array(
        [[0.0, 0.0, -0.15], [0.0, 0.08, -0.08], [0.0, 0.08, -0.07], [0.0, 0.03, -0.03], [0, 0, 0.05]]
    )
    points = se3.apply(T, places)
    found = crowd(points, np.stack([T, se3.make(p=(0.0, 0.0, 0.5)) @ T]))
    np.testing.assert_allclose(found, np.log1p([[1, 2, 1], [0, 0, 0]]))
    np.testing.assert_array_equal(crowd(points[:0], T[None]), np.zeros((1, 3)))
