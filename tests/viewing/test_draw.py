"""What is drawn follows what was decided: positions, correspondence, colours, names."""

from dataclasses import replace

import numpy as np
import pytest

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.geometry.neighbours import nearest
from imop.viewing.draw import ASIDE, LARGEST, SCALE, SMALLEST, draw, spread_colors
from imop.viewing.drawables import Gripper, Label, Path, Points
from imop.viewing.worlds import straight
from tests.viewing.scenes import MOVED, look, observed_scene, region_of, shown


def named(drawn):
    shapes = {shape.name: shape for shape in drawn}
    assert len(shapes) == len(drawn), "two shapes have the same name"
    return shapes


def test_lines_join_each_matched_point_with_its_counterpart():
    ends = named(draw(look()))["matches"].ends
    assert 10 < len(ends) <= 40
    assert np.allclose(se3.apply(MOVED, ends[:, 0] - ASIDE), ends[:, 1])


def test_the_gripper_is_where_the_choice_takes_it_and_was_where_it_was_shown():
    seen = look()
    for chosen in (0, 1):
        shapes = named(draw(seen.choose(chosen)))
        T = seen.choices[chosen].T_world_gripper
        assert np.allclose(shapes["scene/gripper"].T, T)
        assert np.allclose(
            shapes["demonstration/gripper"].T[:3, 3], seen.shown.action.T_world_gripper[:3, 3] + ASIDE
        )
        other = shapes[f"scene/others/{1 - chosen}"]
        assert np.allclose(other.T, seen.choices[1 - chosen].T_world_gripper)


def test_the_region_has_the_colours_of_its_spread_in_both_scenes():
    seen = look()
    shapes = named(draw(seen))
    before, found = shapes["demonstration/region"], shapes["scene/region"]
    assert np.allclose(before.points - ASIDE, region_of(seen.shown.scene))
    assert np.allclose(before.colors, spread_colors(seen.shown.spread))
    # What was found has the colours of what was carried there.
    carried = se3.apply(MOVED, region_of(seen.shown.scene))
    assert np.allclose(found.colors, before.colors[nearest(found.points, carried)[1][:, 0]])
    assert len(found.points) > 0.9 * len(before.points)
    plain = named(draw(look(spread=False)))["demonstration/region"]
    assert len(np.unique(plain.colors, axis=0)) == 1


def test_no_point_is_drawn_twice():
    seen = look()
    shapes = named(draw(seen))
    for side, cloud in (("scene", seen.scene.fused), ("demonstration", seen.shown.scene.fused)):
        drawn = [s for name, s in shapes.items() if name.startswith(side) and isinstance(s, Points)]
        assert sum(len(shape.points) for shape in drawn) == len(cloud)


def test_moving_the_observed_scene_moves_what_is_drawn_of_it():
    seen, T = look(), se3.make(se3.euler(z=0.3), (0.05, -0.1, 0.02))
    moved = replace(seen.scene, fused=replace(seen.scene.fused, points=se3.apply(T, seen.scene.fused.points)))
    choices = tuple(
        replace(
            a,
            T_world_gripper=T @ a.T_world_gripper,
            match=replace(
                a.match,
                p_query=se3.apply(T, a.match.p_query),
                T_query_support=T @ a.match.T_query_support,
            ),
        )
        for a in seen.choices
    )
    here, there = named(draw(seen)), named(draw(replace(seen, scene=moved, choices=choices)))
    assert np.allclose(there["scene/gripper"].T, T @ here["scene/gripper"].T)
    assert np.allclose(there["matches"].ends[:, 1], se3.apply(T, here["matches"].ends[:, 1]))
    assert np.allclose(there["scene/region"].points, se3.apply(T, here["scene/region"].points))
    assert np.allclose(there["demonstration/region"].points, here["demonstration/region"].points)


def test_probabilities_are_told_of_every_candidate():
    texts = [s.text for s in draw(look(probabilities=(0.8, 0.15, 0.04))) if isinstance(s, Label)]
    words = " ".join(texts)
    assert all(f"{k}: {p}%" in words for k, p in ((1, 80), (2, 15), (3, 4)))
    assert any("step 1 of 2" in text for text in texts) and any("80%" in text for text in texts)


def test_what_is_most_unlikely_is_not_drawn_unless_it_is_looked_at():
    seen = look(probabilities=(0.8, 0.001))
    assert "scene/others/1" not in named(draw(seen))
    T = named(draw(seen.choose(1)))["scene/gripper"].T
    assert np.allclose(T, seen.choices[1].T_world_gripper)


def test_the_way_begins_at_the_gripper_and_ends_where_it_goes():
    seen = look()
    way = straight(seen.scene.observation.T_world_gripper, seen.action)
    path = named(draw(replace(seen, ways=(way,))))["scene/path"]
    assert isinstance(path, Path) and np.array_equal(path.points, way)
    assert "scene/path" not in named(draw(seen))


def test_without_a_choice_both_scenes_are_drawn_and_nothing_else_is_claimed():
    nothing = replace(look(), choices=(), problem="nothing is seen")
    shapes = named(draw(nothing))
    assert {"scene/cloud", "demonstration/cloud"} <= set(shapes)
    assert not {"matches", "scene/gripper", "scene/region", "demonstration/region"} & set(shapes)
    alone = named(draw(replace(nothing, shown=None)))
    assert not any(name.startswith("demonstration") for name in alone)


def test_what_is_meant_is_marked():
    here = observed_scene()
    focus = np.zeros(len(here.fused), dtype=bool)
    focus[:7] = True
    shapes = named(draw(replace(look(), scene=replace(here, focus=focus))))
    assert np.array_equal(shapes["scene/focus"].points, here.fused.points[:7])


def test_the_scale_of_spreads_is_monotone_and_ends_where_it_says():
    colors = spread_colors(np.geomspace(SMALLEST / 10, LARGEST * 10, 200))
    assert (np.diff(colors.sum(axis=1)) >= -1e-9).all()
    assert np.allclose(colors[0], SCALE[0]) and np.allclose(colors[-1], SCALE[-1])


def test_fingers_are_as_far_apart_as_the_gripper_is_open():
    gaps = []
    for opening in (0.0, 0.5, 1.0):
        ends = Gripper("g", np.eye(4), opening, (0, 0, 1)).ends
        gaps.append(np.ptp(ends[:2, 0, 1]))
    assert gaps[0] < gaps[1] < gaps[2] < 0.09


def test_a_step_that_was_not_shown_is_refused():
    with pytest.raises(InvalidInput, match="step"):
        shown(step=2)
