from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from imop.demos.regions import (
    MARGIN,
    REACH,
    SegmentedState,
    by_aim,
    displacements,
    invariant_region,
    segmented,
)
from imop.errors import InvalidInput
from imop.geometry import se3
from imop.types import Action, Keyframe
from tests.demos.scenes import NAMES, Box, lift_a_cube, observe

DOWN = se3.euler(x=np.pi)
HOME = se3.make(DOWN, (0.28, 0.0, 1.2))
SIZES = {"cube": (0.025, 0.025, 0.025), "block": (0.06, 0.04, 0.05), "plate": (0.08, 0.05, 0.015)}
IDS = {name: i for i, name in NAMES.items()}
GRASP = se3.make(DOWN, (0, 0, 0.01))
BACKGROUND = ("table", "hand", "fingers")


def keyframe(places, T_world_gripper, hidden=()):
    """Boxes at (x, y, yaw), and an action; `hidden` names cameras that are missing."""
    boxes = []
    for name, (x, y, yaw) in places.items():
        half = SIZES[name]
        T = se3.make(se3.euler(z=yaw), (x, y, 0.75 + half[2]))
        boxes.append(Box(T, half, (200, 30, 30), IDS[name]))
    seen = observe(boxes, HOME, 1.0)
    views = {name: view for name, view in seen.views.items() if name not in hidden}
    return Keyframe(replace(seen, views=views), Action(T_world_gripper, False))


def on(place, T=GRASP):
    """The action fixed to a box at a place."""
    x, y, yaw = place
    return se3.make(se3.euler(z=yaw), (x, y, 0.8)) @ T


def states(scenes, reference, hidden=((), (), ())):
    keyframes = [keyframe(s, on(s[reference]), h) for s, h in zip(scenes, hidden, strict=True)]
    return [segmented(k, BACKGROUND) for k in keyframes]


SCENES = [
    {"cube": (0.30, 0.10, 0.4), "block": (0.10, -0.15, -0.3), "plate": (0.42, -0.10, 1.0)},
    {"cube": (0.20, -0.20, 2.0), "block": (0.35, 0.05, 0.2), "plate": (0.10, 0.20, 0.0)},
    {"cube": (0.40, 0.00, -1.0), "block": (0.15, 0.15, 1.2), "plate": (0.20, -0.20, 0.5)},
]


@pytest.mark.parametrize("reference", list(SIZES))
def test_the_region_is_what_the_action_is_fixed_to(reference):
    support, *partners = states(SCENES, reference)
    region = invariant_region(support, partners)
    assert region.names == (reference,)
    assert set(region.displacement) == set(SIZES)
    others = [d for name, d in region.displacement.items() if name != reference]
    assert region.displacement[reference] < 0.005 and min(others) > 0.02


def test_things_that_stand_together_in_every_scene_tie():
    scenes = []
    for scene in SCENES:
        x, y, yaw = scene["cube"]
        beside = se3.make(se3.euler(z=yaw), (x, y, 0)) @ (0.09, 0, 0, 1)
        scenes.append(scene | {"block": (beside[0], beside[1], yaw)})
    support, *partners = states(scenes, "cube")
    assert set(invariant_region(support, partners).names) == {"cube", "block"}


def test_a_thing_that_agrees_by_chance_in_one_scene_does_not_tie():
    scenes = [dict(s) for s in SCENES]
    T = np.linalg.inv(on(scenes[0]["cube"])) @ se3.make(se3.euler(z=-0.3), (0.10, -0.15, 0.8))
    there = on(scenes[1]["cube"]) @ T
    scenes[1]["block"] = (there[0, 3], there[1, 3], np.arctan2(there[1, 0], there[0, 0]))
    support, *partners = states(scenes, "cube")
    each = displacements(support, partners)[support.names.index("block")]
    assert each[0] < MARGIN < each[1]
    assert invariant_region(support, partners).names == ("cube",)


def test_different_views_of_a_thing_still_agree():
    support, *partners = states(SCENES, "block", [("front",), ("left_shoulder",), ("wrist",)])
    assert invariant_region(support, partners).names == ("block",)


@pytest.mark.parametrize("turns", [(0, 1, 3), (0, 2, 2)])
def test_a_turn_that_changes_nothing_visible_is_no_displacement(turns):
    # The expert knows a front of the cube that nobody can see.
    scenes = [
        s | {"cube": (*s["cube"][:2], s["cube"][2] + t * np.pi / 2)}
        for s, t in zip(SCENES, turns, strict=True)
    ]
    keyframes = [keyframe(s, on(w["cube"])) for s, w in zip(SCENES, scenes, strict=True)]
    support, *partners = [segmented(k, BACKGROUND) for k in keyframes]
    assert invariant_region(support, partners).names == ("cube",)


def test_background_and_what_is_hidden_are_no_segments():
    state = segmented(keyframe({"cube": (0.3, 0.1, 0.0)}, np.eye(4)), BACKGROUND)
    assert state.names == ("cube",)


def test_what_no_partner_sees_has_no_displacement():
    support, partner = (segmented(keyframe(s, on(s["cube"])), BACKGROUND) for s in SCENES[:2])
    alone = segmented(keyframe({"cube": SCENES[2]["cube"]}, on(SCENES[2]["cube"])), BACKGROUND)
    each = displacements(support, [partner, alone])
    block = support.names.index("block")
    assert each[block, 0] > MARGIN and np.isnan(each[block, 1])
    assert set(invariant_region(support, [alone]).displacement) == {"cube"}


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=20, deadline=None)
def test_all_partners_at_once_is_one_after_the_other(seed):
    rng = np.random.default_rng(seed)

    def state(names):
        count = int(rng.integers(10, 30))
        return SegmentedState(names, rng.uniform(-0.1, 0.1, (count, 3)), rng.integers(0, len(names), count))

    support = state(("a", "b", "c"))
    partners = [state(names) for names in (("c", "a"), ("d",), ("b", "d", "a"))]
    together = displacements(support, partners)
    single = np.concatenate([displacements(support, [p]) for p in partners], axis=1)
    np.testing.assert_allclose(together, single)
    assert np.nanmax(together, initial=0.0) <= REACH


def test_without_partners_or_segmentation_there_is_no_region():
    state = segmented(keyframe({"cube": (0.3, 0.1, 0.0)}, np.eye(4)), BACKGROUND)
    with pytest.raises(InvalidInput, match="partners"):
        invariant_region(state, [])
    with pytest.raises(InvalidInput, match="instance"):
        segmented(lift_a_cube().stripped().keyframes[0])


def test_demonstrations_belong_together_by_task_variation_and_objects():
    one = ("test/lift", 2, 7)
    shown = [one, ("test/lift", 0, 7), ("test/lift", 2, 8), one, ("test/lift", 2, -1)]
    found = by_aim(shown)
    assert found == {
        ("test/lift", 2, 7): [0, 3],
        ("test/lift", 0, 7): [1],
        ("test/lift", 2, 8): [2],
        ("test/lift", 2, -1): [4],
    }
