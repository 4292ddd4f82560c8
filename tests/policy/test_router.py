"""The advancing router."""

from imop.policy.router import AdvancingRouter
from tests.policy.scenes import above, scene, transitions

HOME = above(0, 0, 1)
STATE = scene([], HOME)
STEPS = transitions([STATE] * 4, [(HOME, True)] * 3)


def test_steps_follow_each_other_once_taken_and_the_last_stays():
    router = AdvancingRouter()
    router.watch(STEPS)
    seen = []
    for _ in range(5):
        assert router.route(STATE) == router.route(STATE)
        seen.append(router.route(STATE))
        router.took(*seen[-1])
    assert seen == [(0, 0), (0, 1), (0, 2), (0, 2), (0, 2)]
    router.reset()
    assert router.route(STATE) == (0, 0)


def test_the_first_demonstration_counts():
    router = AdvancingRouter()
    router.watch(STEPS)
    router.watch(STEPS[:1])
    for _ in range(2):
        router.took(*router.route(STATE))
    assert router.route(STATE) == (0, 2)
