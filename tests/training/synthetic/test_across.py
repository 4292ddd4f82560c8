"""Pairs of a step on one thing and the same step on another of its kind."""

import numpy as np
import pytest

from imop.geometry import se3
from imop.training.data.invariance import INVARIANT, distances, has_invariant_part
from imop.training.synthetic.across import pairs_across
from imop.training.synthetic.families import HELD_OUT, TRAINING
from imop.training.synthetic.pairs import synthetic_pairs
from imop.training.synthetic.stage import Stage, Unreachable
from imop.training.synthetic.surfaces import surface

LIDS = {"lid": HELD_OUT["lid"], "tray": TRAINING["tray"], "block": TRAINING["block"]}


def made(variation, families, count, seed=0):
    rng, found = np.random.default_rng(seed), []
    while len(found) < count:
        try:
            found += [example.pair for example in pairs_across(families, variation, rng)]
        except Unreachable:
            continue
    return found


@pytest.fixture(scope="module")
def shaped():
    return made("both", LIDS, 30, seed=1)


def test_the_right_motion_carries_the_demonstrated_action_to_that_on_the_other_thing(shaped):
    """Each pair is there in both directions, so the query's action is the other one's demonstrated one."""
    compared = 0
    for pair in shaped:
        back = [p for p in shaped if p.support is pair.query and p.query is pair.support]
        for other in back:
            np.testing.assert_allclose(
                pair.T_query_support[0] @ pair.T_world_goal, other.T_world_goal, atol=1e-9
            )
            compared += 1
    assert compared > 10


def test_labels_are_there_for_the_region_only_and_near_zero_somewhere_on_it(shaped):
    for pair in shaped:
        assert not np.isfinite(pair.invariance[~pair.region]).any()
        assert np.isfinite(pair.invariance[pair.region]).mean() > 0.9
        assert has_invariant_part(pair.invariance)


def test_shapes_differ_and_colours_alone_leave_no_label(shaped):
    far = [float(np.nanquantile(pair.invariance, 0.9)) for pair in shaped]
    assert np.median(far) > INVARIANT
    assert all(pair.invariance is None for pair in made("color", LIDS, 6))


def test_the_knob_of_a_lid_is_invariant_and_its_rim_is_not():
    """Sizes of two lids: seen from a grasp of the knob, rims lie where they differ."""
    lid = HELD_OUT["lid"]
    first, other = (Stage([lid(np.random.default_rng(seed), np.random.default_rng(0))]) for seed in (1, 2))
    points, others = (surface(stage, 0)["body"] for stage in (first, other))
    grasp = first.things[0].holds[0].T_link_gripper, other.things[0].holds[0].T_link_gripper
    label = distances(points, grasp[0], others, grasp[1])
    from_knob = np.linalg.norm(se3.apply(se3.invert(grasp[0]), points), axis=1)
    rim = from_knob > 0.9 * from_knob.max()
    assert np.median(label[from_knob < 0.015]) < 0.006
    assert np.median(label[rim]) > 2 * np.median(label[from_knob < 0.015])


def test_a_thing_is_at_no_distance_from_itself_wherever_it_stands():
    stage = Stage([TRAINING["mug"](np.random.default_rng(0), np.random.default_rng(0))])
    points = surface(stage, 0)["body"]
    moved = se3.make(se3.euler(z=1.0), (0.3, -0.1, 0.2))
    goal = se3.make(p=(0.0, 0.0, 0.1))
    assert distances(points, goal, se3.apply(moved, points), moved @ goal).max() < 1e-9


def test_surfaces_go_all_around_and_show_what_moves():
    stage = Stage([TRAINING["drawers"](np.random.default_rng(0), np.random.default_rng(0))])
    found = surface(stage, 0)
    assert set(found) == set(stage.links[0]) and all(len(points) > 100 for points in found.values())
    low, high = found["body"].min(axis=0), found["body"].max(axis=0)
    assert high[2] - low[2] == pytest.approx(stage.top(0) - stage.bottom(0), abs=0.01)


def test_the_shares_of_the_mix_are_met_and_the_same_things_are_those_of_no_mix():
    families = {name: TRAINING[name] for name in ("block", "tray", "drawers")}
    mixed = list(synthetic_pairs(3, 12, families, (0.5, 0.0, 0.5, 0.0)))
    same = [pair for pair in mixed if pair.invariance is None]
    assert len(same) == 6
    for a, b in zip(same, synthetic_pairs(3, 6, families), strict=True):
        np.testing.assert_array_equal(a.query.points, b.query.points)
        np.testing.assert_array_equal(a.T_query_support, b.T_query_support)
