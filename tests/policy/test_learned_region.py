"""What becomes of the region network's answer. The network is played: what counts is what is made of it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from imop.geometry import se3
from imop.networks.graph import GraphConfig
from imop.networks.region import RegionPrediction
from imop.policy.interfaces import PolicyConfig
from imop.policy.learned import find_shown_regions
from tests.policy.scenes import BLUE, GREY, RED, TABLE, above, at, box, moved, scene, transitions

SPREAD = 0.007
HOME = above(0.0, -0.3, 1.2)
NOTE, CHEST = (0.09, 0.06, 0.02), (0.2, 0.2, 0.1)
TOP = TABLE + 0.1

USUAL = PolicyConfig()


def model(wanted):
    """A model whose region is where `wanted` (points (N, 3) -> (N,) mask) is True."""

    def region(batch):
        points = batch.before.points.double().numpy()
        logits = torch.from_numpy(np.where(wanted(points), 5.0, -5.0))
        return RegionPrediction([logits], torch.full_like(logits, SPREAD))

    return SimpleNamespace(config=SimpleNamespace(graph=GraphConfig()), region=region)


def taking():
    """A note is taken from a chest."""
    chest, note = box(CHEST, GREY, at(0.1, 0.1)), box(NOTE, RED, at(0.12, 0.1, TOP))
    grasp, lift = above(0.12, 0.1, TOP + 0.01), above(0.12, 0.1, TOP + 0.2)
    lifted = moved(note, lift @ se3.invert(grasp))
    clouds = ((note, HOME, 1.0), (note, grasp, 0.5), (lifted, lift, 0.5))
    scenes = [scene([chest, thing], T, opening) for thing, T, opening in clouds]
    return transitions(scenes, [(grasp, False), (lift, False)]), note


def everything(points):
    return points[:, 2] > TABLE + 0.005


def test_what_is_taken_is_told_from_the_rest_of_the_region():
    steps, note = taking()
    shown = find_shown_regions(model(everything), steps, USUAL)
    payload = shown[0].payload
    assert payload is not None and len(payload) < 0.5 * len(shown[0].region.cloud)
    np.testing.assert_allclose(payload.points.mean(axis=0), note.points.mean(axis=0), atol=0.01)
    assert shown[1].payload is None
    for step in shown:
        np.testing.assert_allclose(step.region.spread, np.full(len(step.region.cloud), SPREAD))


def test_a_region_that_is_what_is_taken_needs_no_telling():
    steps, note = taking()
    lower, upper = note.points.min(axis=0) - 0.004, note.points.max(axis=0) + 0.004

    def on_note(points):
        return np.all((points > lower) & (points < upper), axis=1) & (points[:, 2] > TOP + 0.01)

    assert find_shown_regions(model(on_note), steps, USUAL)[0].payload is None


@pytest.mark.parametrize("place", [(0.25, 0.1), (0.1, -0.1)])
def test_bare_ground_gives_way_to_what_stands_beside(place):
    chest, cup = box((0.1, 0.1, 0.1), GREY, at(0.1, 0.1)), box((0.04, 0.04, 0.06), BLUE, at(*place))
    down = above(*place, TABLE + 0.06)
    held = moved(cup, at(0.0, 0.0, 0.3))
    scenes = [
        scene([chest, held], at(0.0, 0.0, 0.3) @ down, 0.5),
        scene([chest, cup], down),
    ]
    steps = transitions(scenes, [(down, True)])

    def ground_there(points):
        return (np.linalg.norm(points[:, :2] - place, axis=1) < 0.1) & (points[:, 2] < TABLE + 0.002)

    shown = find_shown_regions(model(ground_there), steps, USUAL)[0]
    assert shown.region.cloud.points[:, 2].min() > TABLE - 0.002
    height = shown.region.cloud.points[:, 2] - TABLE
    assert (height > 0.01).mean() > 0.8


def test_the_likeliest_few_are_the_region_if_nothing_is_likely():
    steps, _ = taking()
    shown = find_shown_regions(
        model(lambda points: np.zeros(len(points), dtype=bool)), steps, PolicyConfig()
    )[0]
    assert len(shown.inside) >= 8 and len(shown.region.cloud)


def test_holes_in_a_thing_are_filled_and_other_things_left_alone():
    chest, cup = box(CHEST, GREY, at(0.1, 0.1)), box((0.04, 0.04, 0.06), BLUE, at(0.4, -0.2))
    grasp = above(0.1, 0.1, TOP + 0.01)
    steps = transitions([scene([chest, cup], T) for T in (HOME, grasp)], [(grasp, False)])

    def most_of_the_chest(points):
        return (points[:, 2] > TABLE + 0.005) & (points[:, 0] < 0.15)

    shown = find_shown_regions(model(most_of_the_chest), steps, USUAL)[0]
    assert shown.region.cloud.points[:, 0].max() < 0.17
    assert 0.195 < shown.completed[:, 0].max() < 0.21
    cloud = steps[0].before.cloud.points
    assert all((point == cloud).all(axis=1).any() for point in shown.completed[::40])


@pytest.mark.parametrize("size", [0.03, 0.1])
def test_a_scrap_elsewhere_gives_way_to_what_the_gripper_goes_to(size):
    rack = box((0.1, 0.1, 0.2), GREY, at(0.3, 0.2))
    scrap = box((size, size, size), BLUE, at(0.0, -0.2), spacing=0.008)
    place = above(0.3, 0.2, TABLE + 0.22)
    steps = transitions([scene([rack, scrap], T, 0.0) for T in (HOME, place)], [(place, False)])

    def on_scrap(points):
        return (points[:, 1] < 0.0) & (points[:, 2] > TABLE + 0.002)

    region = find_shown_regions(model(on_scrap), steps, USUAL)[0].region.cloud.points
    assert (region[:, 1].min() > 0.0) == (size < 0.05)


def test_what_is_out_of_focus_is_not_in_the_region():
    steps, _ = taking()
    cloud = steps[0].before.fused
    upper = cloud.points[:, 2] > TOP - 0.002
    before = replace(steps[0].before, focus=upper)
    shown = find_shown_regions(
        model(everything), [replace(steps[0], before=before), *steps[1:]], PolicyConfig()
    )
    assert shown[0].region.cloud.points[:, 2].min() > TOP - 0.02
    assert shown[1].region.cloud.points[:, 2].min() < TOP - 0.05
