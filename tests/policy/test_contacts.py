"""Events at the gripper of hand-made demonstrations."""

import numpy as np

from imop.geometry import se3
from imop.geometry.clusters import find_objects
from imop.policy.contacts import find_contacts
from tests.policy.scenes import BLUE, RED, TABLE, above, at, box, moved, scene, transitions

CUBE = (0.05, 0.05, 0.05)
GRASP = above(0.1, 0.1, TABLE + 0.04)
LIFT = above(0.1, 0.1, TABLE + 0.24)
HIGH = above(0.3, -0.1, TABLE + 0.3)


def contacts_of(scenes, actions):
    steps = transitions(scenes, actions)
    return find_contacts(steps, [find_objects(step.before.cloud, step.before.ground.plane) for step in steps])


def test_grasp_carry_release():
    cube = box(CUBE, RED, at(0.1, 0.1))
    lifted = moved(cube, LIFT @ se3.invert(GRASP))
    carried = moved(cube, HIGH @ se3.invert(GRASP))
    scenes = [
        scene([cube], HIGH),
        scene([cube], GRASP, 0.6),
        scene([lifted], LIFT, 0.6),
        scene([carried], HIGH, 1.0),
    ]
    found = contacts_of(scenes, [(GRASP, False), (LIFT, False), (HIGH, True)])
    assert found.event.tolist() == [True, False, True]
    assert found.holding.tolist() == [False, True, True]
    assert [len(p) > 100 for p in found.p_gripper_held] == [False, True, True]
    held = np.concatenate([found.p_gripper_held[1]])
    np.testing.assert_allclose(se3.apply(GRASP, held).mean(axis=0), cube.points.mean(axis=0), atol=0.01)
    assert [found.following(k) for k in range(3)] == [0, 2, 2]


def test_neighbours_that_stay_are_not_held():
    cube, other = box(CUBE, RED, at(0.1, 0.1)), box(CUBE, RED, at(0.1, 0.17))
    lifted = moved(cube, LIFT @ se3.invert(GRASP))
    scenes = [scene([cube, other], HIGH), scene([cube, other], GRASP, 0.6), scene([lifted, other], LIFT, 0.6)]
    held = contacts_of(scenes, [(GRASP, False), (LIFT, False)]).p_gripper_held[1]
    assert len(held) and se3.apply(GRASP, held)[:, 1].max() < 0.13


def test_closing_and_opening_in_the_air_are_no_events():
    scenes = [scene([box(CUBE, RED, at(0.1, 0.1))], T, w) for T, w in ((HIGH, 1.0), (HIGH, 0.0), (LIFT, 1.0))]
    found = contacts_of(scenes, [(HIGH, False), (LIFT, True)])
    assert not found.event.any() and not found.holding.any() and found.following(0) is None


def test_what_the_next_grasp_takes_is_known_before_it():
    cube, button = box(CUBE, RED, at(0.1, 0.1)), box((0.03, 0.03, 0.02), BLUE, at(0.4, -0.2))
    lifted, carried = (moved(cube, T @ se3.invert(GRASP)) for T in (LIFT, HIGH))
    above_cube = above(0.1, 0.1, TABLE + 0.15)
    scenes = [
        scene([cube, button], HIGH),
        scene([cube, button], above_cube),
        scene([cube, button], GRASP, 0.6),
        scene([lifted, button], LIFT, 0.6),
        scene([carried, button], HIGH, 1.0),
    ]
    actions = [(above_cube, True), (GRASP, False), (LIFT, False), (HIGH, True)]
    steps, found = transitions(scenes, actions), contacts_of(scenes, actions)
    for k in (0, 1):
        taken = found.taken(k, steps)
        np.testing.assert_allclose(taken.mean(axis=0), cube.points.mean(axis=0), atol=0.01)
    assert not len(found.taken(2, steps)) and not len(found.taken(3, steps))


def test_a_retreat_from_what_was_pressed_does_not_go_to_take_anything():
    cube, button = box(CUBE, RED, at(0.1, 0.1)), box((0.03, 0.03, 0.02), BLUE, at(0.4, -0.2))
    press, away = above(0.4, -0.2, TABLE + 0.02), above(0.4, -0.2, TABLE + 0.15)
    scenes = [
        scene([cube, button], HIGH, 0.0),
        scene([cube, button], press, 0.0),
        scene([cube, button], away, 1.0),
        scene([cube, button], GRASP, 0.6),
        scene([moved(cube, LIFT @ se3.invert(GRASP)), button], LIFT, 0.6),
    ]
    actions = [(press, False), (away, True), (GRASP, False), (LIFT, False)]
    steps, found = transitions(scenes, actions), contacts_of(scenes, actions)
    assert [len(found.taken(k, steps)) > 0 for k in range(4)] == [True, False, True, False]
