"""In a terminal, too, nothing moves before somebody says yes."""

from imop.viewing.confirm import attend
from imop.viewing.session import Session
from tests.viewing.scenes import FakeDecider, FakeWorld


def answered(*answers, **world):
    session, told, left = Session(FakeDecider(), FakeWorld(**world)), [], list(answers)
    done = attend(session, lambda question: left.pop(0), told.append)
    return session, done, " ".join(told)


def test_only_a_yes_moves():
    session, done, told = answered("", "no", "l", "n", "x", "Y ", "q")
    assert session._decider.taken == [1] and len(session._world.performed) == 1 and not done
    assert "80%" in told and "15%" in told


def test_it_ends_with_the_episode():
    session, done, told = answered("y", "y", "y")
    assert done and session.over and "done" in told


def test_what_cannot_be_done_is_said_and_asked_again():
    session, done, told = answered("n", "n", "y", "q")
    assert "rejected" in told and session._world.performed == [] and not done
