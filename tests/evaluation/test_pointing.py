"""Somebody points at the thing that is acted on first, until the hand has it."""

import numpy as np
import pytest

from imop.evaluation.pointing import focus_on, pointing
from imop.geometry.cloud import fuse
from imop.geometry.focus import in_focus
from imop.tasks.env import make_task
from imop.tasks.expert import record_demonstration


@pytest.fixture(scope="module")
def shown():
    return record_demonstration(make_task("tabletop/stack_cubes"), 1_000_000, 0, 0)


def test_the_thing_is_pointed_at_until_the_hand_has_closed(shown):
    point = pointing(shown)
    closing = next(k for k, keyframe in enumerate(shown.keyframes) if not keyframe.action.gripper_open)
    seen = shown.keyframes[0].observation
    assert closing > 0 and all(point(k, seen) is not None for k in range(closing + 1))
    assert all(point(k, seen) is None for k in range(closing + 1, len(shown)))


def test_what_is_pointed_at_is_that_thing_and_nothing_else(shown):
    seen, name = shown.keyframes[0].observation, shown.keyframes[0].object_name
    cloud = fuse(seen)
    meant = in_focus(focus_on(name, seen), seen, cloud)
    number = next(i for i, other in seen.instance_names.items() if other == name)
    assert meant[cloud.ids == number].mean() > 0.9
    # A thing behind its edge is seen by the same pixels at another distance.
    assert np.mean(cloud.ids[meant] == number) > 0.9


def test_what_is_not_in_sight_or_has_no_name_cannot_be_pointed_at(shown):
    seen = shown.keyframes[0].observation
    assert focus_on("nothing/body", seen) is None and focus_on(None, seen) is None
    assert focus_on(shown.keyframes[0].object_name, seen.stripped()) is None
