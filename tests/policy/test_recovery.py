"""What came to nothing is looked for elsewhere; what went well is not remembered."""

from types import SimpleNamespace

import numpy as np

from imop.geometry import se3
from imop.policy.recovery import BAD_LUCK, Attempts, same_place
from imop.policy.router import Option
from tests.policy.scenes import above, scene

SENT = above(0.1, 0.0, 0.9)


def seen(T_world_gripper):
    return scene([], T_world_gripper).observation


def step(number, demonstration=0):
    return Option(demonstration, number)


def luck(tried):
    return [one.luck for one in tried]


def test_an_arm_that_is_where_it_was_sent_has_arrived():
    attempts = Attempts()
    assert attempts.arrived(seen(above(0, 0, 1.0)))
    attempts.took(step(0), SENT)
    assert attempts.arrived(seen(SENT @ se3.make(se3.euler(z=0.1), (0.01, 0, 0))))
    assert attempts.go_on(step(1)) == ()


def test_an_arm_that_is_elsewhere_or_turned_was_not_moved_and_cannot_be():
    for there in (above(0.13, 0.0, 0.9), SENT @ se3.make(se3.euler(z=0.3))):
        attempts = Attempts()
        attempts.took(step(2), SENT)
        assert not attempts.arrived(seen(there))
        (tried,) = attempts.go_on(step(2))
        assert tried.luck == 0 and np.array_equal(tried.T_world_gripper, SENT)
        # It was said once; the step before it is the last one again.
        assert attempts.arrived(seen(there))


def test_what_is_done_again_failed_from_there_on():
    attempts = Attempts()
    for number in range(4):
        attempts.took(step(number), above(0.1 * number, 0, 0.9))
    assert luck(attempts.go_on(step(4))) == []
    assert luck(attempts.go_on(step(1))) == [BAD_LUCK]
    attempts.took(step(1), SENT)
    assert [luck(attempts.go_on(step(number))) for number in (2, 3)] == [[BAD_LUCK], [BAD_LUCK]]
    assert luck(attempts.go_on(step(1))) == [BAD_LUCK, BAD_LUCK]
    assert luck(attempts.go_on(step(0))) == [BAD_LUCK]
    # The arm is still where it was sent last.
    assert attempts.arrived(seen(SENT)) and not attempts.arrived(seen(above(0.4, 0, 0.9)))


def test_other_demonstrations_did_not_fail():
    attempts = Attempts()
    attempts.took(step(0), SENT)
    assert attempts.go_on(step(0, demonstration=1)) == ()
    assert luck(attempts.go_on(step(0))) == [BAD_LUCK]


def test_steps_that_are_fixed_to_the_same_points_have_the_same_place():
    rng = np.random.default_rng(0)
    thing = rng.uniform(-0.05, 0.05, (200, 3))
    regions = [thing, thing + 0.002, thing[:150], thing + 0.3, np.zeros((0, 3)), thing]
    steps = [SimpleNamespace(region=region) for region in regions]
    assert same_place(steps) == [False, True, True, False, False, False]


def test_a_step_is_done_again_once_if_the_next_is_found_elsewhere():
    attempts, elsewhere = Attempts(), above(0.2, 0.0, 0.9)
    assert not attempts.undone(step(0), elsewhere, SENT)
    attempts.took(step(0), SENT)
    assert not attempts.undone(step(1), above(0.11, 0.0, 0.9), SENT)
    assert not attempts.undone(step(2), elsewhere, SENT) and not attempts.undone(step(1, 1), elsewhere, SENT)
    assert attempts.undone(step(1), elsewhere, SENT)
    attempts.took(step(0), elsewhere)
    assert not attempts.undone(step(1), above(0.4, 0.0, 0.9), elsewhere)
