"""The checker finds what would make a task useless; the tasks of the suite pass it in test_tabletop.py."""

from dataclasses import replace

import numpy as np
import pytest

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.tasks.check_task import check_task
from imop.tasks.tabletop.lid_off_pot import LidOffPot


def problems(**members):
    """Of the task of the pot with other members."""
    return "\n".join(check_task(type("Other", (LidOffPot,), members), seeds=(0, 1)))


def test_what_falls_by_itself_is_named():
    def reset(self, world, rng):
        LidOffPot.reset(self, world, rng)
        world.set_free_pose("lid/body", world.pose("lid/body") @ se3.make(p=(0, 0, 0.05)))

    found = problems(reset=reset)
    assert "lid/body moved untouched" in found and "pot/body" not in found


def test_waypoints_that_stay_are_found_though_the_clutter_differs():
    def reset(self, world, rng):
        LidOffPot.reset(self, world, np.random.default_rng(0))
        world.set_free_pose("clutter0/body", se3.make(p=(rng.uniform(0.5, 0.6), 0, 0.8)))

    assert "waypoints are where they were" in problems(reset=reset)


def test_a_waypoint_on_a_body_that_is_not_drawn_is_told_by_its_number():
    def build(self, spec, variation, rng):
        LidOffPot.build(self, spec, variation, rng)
        spec.worldbody.add_body(name="marker", mocap=True)

    def waypoints(self, world):
        first, *others = LidOffPot.waypoints(self, world)
        T_frame_gripper = se3.invert(world.pose("marker")) @ first.target(world)
        return [replace(first, frame="marker", T_frame_gripper=T_frame_gripper), *others]

    found = problems(build=build, waypoints=waypoints)
    assert "waypoint 0 hangs on marker" in found and "waypoint 1" not in found


def test_another_number_of_waypoints_in_another_scene_is_found():
    def waypoints(self, world):
        on_lid = LidOffPot.waypoints(self, world)
        return on_lid if world.pose("pot/body")[1, 3] > 0 else [on_lid[0], *on_lid]

    assert "give always as many" in "\n".join(
        check_task(type("Other", (LidOffPot,), {"waypoints": waypoints}), seeds=range(4))
    )


def test_no_variation_is_a_finding():
    assert problems(variations=0) == "variations is 0: there has to be one at least"


@pytest.mark.parametrize("seeds", [(), (3,), (2, 2), (-1, 1)])
def test_two_different_seeds_are_needed(seeds):
    with pytest.raises(InvalidInput, match="seeds"):
        check_task(LidOffPot, seeds)
