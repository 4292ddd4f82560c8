"""An episode without anybody to ask: the likeliest that can be done, and an end in every case."""

import pytest

from imop.viewing.alone import IN_A_ROW, go_on
from imop.viewing.session import Session
from imop.viewing.worlds import Outcome
from tests.viewing.scenes import FakeDecider, FakeWorld, look


def play(world, most=9):
    told = []
    return go_on(Session(FakeDecider(), world), most, told.append), told


def test_it_goes_on_until_the_world_says_that_it_is_over():
    world = FakeWorld(length=3)
    assert play(world) == ("", ["done"]) and len(world.performed) == 3


def test_a_choice_that_has_no_way_is_passed_over():
    world = FakeWorld(length=1, fails=[look().choices[0].T_world_gripper])
    assert play(world)[0] == ""
    assert world.performed[0].confidence == look().choices[1].confidence


def test_without_any_way_nothing_moves_and_the_reason_is_said():
    world = FakeWorld(fails=[choice.T_world_gripper for choice in look().choices])
    assert "unreachable" in play(world)[0] and world.performed == []


class Failing(FakeWorld):
    def perform(self, action):
        super().perform(action)
        return Outcome(False, "not done: protective_stop", "protective_stop")


def test_motions_that_fail_one_after_the_other_end_it():
    world = Failing(length=99)
    assert "protective_stop" in play(world)[0] and len(world.performed) == IN_A_ROW


@pytest.mark.parametrize("most", [1, 4])
def test_no_more_is_done_than_allowed(most):
    world = FakeWorld(length=99)
    assert f"{most} actions" in play(world, most)[0] and len(world.performed) == most


def test_who_sees_nothing_any_more_ends():
    world = FakeWorld()
    session = Session(FakeDecider(), world)
    world.blind = True
    assert "camera is gone" in go_on(session, 5, print) and len(world.performed) == 1
