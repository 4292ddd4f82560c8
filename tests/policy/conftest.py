"""One simulated demonstration and one other scene of the same task, shared by the policy's tests."""

import pytest

from imop.geometry.perception import Perception
from imop.policy.one_shot import OneShotPolicy
from imop.policy.registration import RegistrationMatcher
from imop.robots.panda import panda_self_filter
from imop.tasks.env import make_task
from imop.tasks.expert import record_demonstration

TASK = "tabletop/lid_off_pot"


@pytest.fixture(scope="session")
def perception():
    return Perception(panda_self_filter().is_robot)


@pytest.fixture(scope="session")
def shown():
    """The demonstration that is watched."""
    return record_demonstration(make_task(TASK), seed=1_000_000, instance_seed=0)


@pytest.fixture(scope="session")
def wanted():
    """What the expert does in another scene with the same pot."""
    return record_demonstration(make_task(TASK), seed=2, instance_seed=0)


@pytest.fixture(scope="session")
def _watched(perception, shown):
    policy = OneShotPolicy(RegistrationMatcher.from_pretrained(), perception)
    policy.watch(shown.stripped())
    return policy


@pytest.fixture
def policy(_watched):
    """A policy that has watched `shown` and begins a new episode."""
    _watched.reset()
    return _watched
