"""Regions of hand-made demonstrations with boxes: which thing a step refers to, and what is held."""

import numpy as np

from imop.geometry import se3
from imop.policy.interfaces import PolicyConfig
from imop.policy.region import find_regions
from tests.policy.scenes import BLUE, GREEN, RED, TABLE, above, at, box, moved, scene, transitions

CUBE = (0.05, 0.05, 0.05)
PLATE = (0.12, 0.12, 0.02)
HOME = above(0.0, -0.3, 1.2)
GRASP = above(0.1, 0.1, TABLE + 0.04)
LIFT = above(0.1, 0.1, TABLE + 0.24)
PLACE = above(0.4, -0.1, TABLE + 0.06)


def found(steps):
    return find_regions(steps, PolicyConfig())


def is_like(region, color):
    return np.allclose(region.cloud.colors, np.array(color, np.float32))


def pick_and_place():
    """A red cube goes from (0.1, 0.1) onto a green plate at (0.4, -0.1); a blue cube stands by."""
    cube, plate = box(CUBE, RED, at(0.1, 0.1)), box(PLATE, GREEN, at(0.4, -0.1))
    other = box(CUBE, BLUE, at(0.3, 0.25))
    held = moved(cube, LIFT @ se3.invert(GRASP))
    placed = moved(cube, PLACE @ se3.invert(GRASP))
    before = above(0.1, 0.1, TABLE + 0.14)
    poses = [(HOME, 1.0), (before, 1.0), (GRASP, 0.6), (LIFT, 0.6), (PLACE, 1.0)]
    cubes = [cube, cube, cube, held, placed]
    scenes = [scene([c, plate, other], T, opening) for c, (T, opening) in zip(cubes, poses, strict=True)]
    return transitions(scenes, [(before, True), (GRASP, False), (LIFT, False), (PLACE, True)])


def test_approach_and_grasp_refer_to_what_is_grasped():
    regions = found(pick_and_place())
    assert is_like(regions[0], RED) and is_like(regions[1], RED)


def test_lift_refers_to_what_is_in_the_hand():
    assert is_like(found(pick_and_place())[2], RED)


def test_placing_refers_to_where_it_is_placed_and_leaves_the_held_thing_out():
    region = found(pick_and_place())[3]
    assert is_like(region, GREEN)
    p_gripper_cube = se3.apply(se3.invert(GRASP), box(CUBE, RED, at(0.1, 0.1)).points)
    assert len(region.p_gripper_held) > 0.8 * len(p_gripper_cube)
    assert np.abs(region.p_gripper_held - p_gripper_cube.mean(axis=0)).max() < 0.05


def test_weight_is_largest_near_the_contact():
    long = box((0.04, 0.4, 0.04), RED, at(0.2, 0.0))
    contact = above(0.2, 0.18, TABLE + 0.02)
    scenes = [scene([long], HOME), scene([long], contact, 0.5)]
    region = found(transitions(scenes, [(contact, False)]))[0]
    near = np.linalg.norm(region.cloud.points - contact[:3, 3], axis=1)
    assert np.corrcoef(near, region.weight)[0, 1] < -0.9
    assert region.weight.min() > 0 and region.weight.max() <= 1


def test_a_part_that_hangs_in_the_air_is_taken_with_what_carries_it():
    case = box((0.2, 0.2, 0.3), GREEN, at(0.3, 0.0))
    handle = box((0.03, 0.08, 0.02), RED, at(0.3, 0.0, TABLE + 0.2) @ se3.make(p=(-0.16, 0, 0)))
    contact = above(0.14, 0.0, TABLE + 0.21)
    scenes = [scene([case, handle], HOME), scene([case, handle], contact, 0.5)]
    region = found(transitions(scenes, [(contact, False)]))[0]
    red = region.cloud.colors[:, 0] > 0.5
    assert red.sum() == len(handle) and (~red).sum() > 0.9 * len(case)


def test_press_without_a_grasp_refers_to_what_the_tip_touches():
    button, other = box((0.06, 0.06, 0.03), RED, at(0.2, 0.2)), box(CUBE, BLUE, at(0.2, -0.2))
    ready, pressed = above(0.2, 0.2, TABLE + 0.15), above(0.2, 0.2, TABLE + 0.03)
    scenes = [scene([button, other], T, 0.0) for T in (HOME, ready, pressed)]
    regions = found(transitions(scenes, [(ready, False), (pressed, False)]))
    assert is_like(regions[0], RED) and is_like(regions[1], RED)


def test_bare_table_still_gives_a_region():
    scenes = [scene([], HOME), scene([], GRASP, 0.5)]
    region = found(transitions(scenes, [(GRASP, False)]))[0]
    assert len(region.cloud) and len(region.weight) == len(region.cloud)


def test_closing_on_nothing_is_not_a_grasp():
    first, second = box((0.06, 0.06, 0.03), RED, at(0.2, 0.2)), box((0.06, 0.06, 0.03), BLUE, at(0.2, -0.2))
    poses = [above(0.2, y, TABLE + h) for y, h in ((0.2, 0.12), (0.2, 0.03), (0.2, 0.12), (-0.2, 0.12))]
    poses.append(above(0.2, -0.2, TABLE + 0.03))
    openings = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    scenes = [scene([first, second], T, w) for T, w in zip([HOME, *poses], openings, strict=True)]
    regions = found(transitions(scenes, [(T, False) for T in poses]))
    assert [is_like(region, RED) for region in regions] == [True, True, True, False, False]
    assert is_like(regions[3], BLUE) and is_like(regions[4], BLUE)


def test_what_is_next_to_a_place_is_a_part_of_the_region_around_its_nearest_point():
    long = box((0.04, 0.4, 0.04), RED, at(0.2, 0.0))
    contact = above(0.2, 0.18, TABLE + 0.02)
    region = found(transitions([scene([long], HOME), scene([long], contact, 0.5)], [(contact, False)]))[0]
    part = region.next_to(np.array([0.2, 0.5, TABLE]), 0.05)
    assert 0 < len(part.cloud) == len(part.weight) < len(region.cloud)
    assert np.ptp(part.cloud.points[:, 1]) <= 0.05
    assert part.cloud.points[:, 1].max() == region.cloud.points[:, 1].max()
