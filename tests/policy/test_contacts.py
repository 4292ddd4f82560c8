"""Events at the gripper of hand-made demonstrations."""

import numpy as np

from imop.geometry import se3
from imop.policy.contacts import find_contacts
from imop.policy.objects import find_objects
from tests.policy.scenes import RED, TABLE, above, at, box, moved, scene, transitions

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
