"""An episode goes on only when somebody agrees, and as was agreed."""

import numpy as np
import pytest

from imop.errors import InvalidInput
from imop.viewing.session import Session
from tests.viewing.scenes import BLUE_AT, GREEN_AT, MOVED, FakeDecider, FakeWorld, look, observed_scene


@pytest.fixture
def session():
    return Session(FakeDecider(), FakeWorld())


def at_thing(session, T_world_thing):
    """Point at a thing from above."""
    origin = T_world_thing[:3, 3] + [0.0, 0.0, 1.0]
    return session.point(origin, np.array([0.0, 0.0, -2.0]))


def test_nothing_moves_before_somebody_agrees(session):
    session.look()
    session.choose(1)
    session.choose(0)
    session.reject()
    assert session._world.performed == [] and session._decider.taken == []
    assert session._decider.resets == 1 and len(session.looks) == 1


def test_what_is_accepted_is_performed_and_the_policy_is_told(session):
    session.accept()
    session.reject()
    wanted = session.present.action
    session.accept()
    assert session._decider.taken == [0, 1]
    assert np.array_equal(session._world.performed[1].T_world_gripper, wanted.T_world_gripper)
    assert [one.chosen for one in session.looks] == [0, 1, 0]


def test_an_episode_ends_where_the_world_says_so(session):
    for _ in range(3):
        session.accept()
    assert session.over and session.words == "done" and len(session.looks) == 3
    for act in (session.accept, session.reject, session.look, lambda: session.choose(0)):
        with pytest.raises(InvalidInput, match="over"):
            act()
    assert len(session._world.performed) == 3


def test_when_all_are_rejected_nothing_can_be_accepted_until_one_looks_again(session):
    session.reject()
    session.reject()
    assert session.present.action is None and "rejected" in session.present.problem
    with pytest.raises(InvalidInput, match="rejected"):
        session.accept()
    session.look()
    session.accept()
    assert session._decider.taken == [0]


@pytest.mark.parametrize(("place", "number"), [(MOVED @ GREEN_AT, 0), (BLUE_AT, 1)])
def test_what_is_pointed_at_is_decided_for(session, place, number):
    assert at_thing(session, place)
    assert session.present.chosen == number and len(session.looks) == 1
    meant = session._decider.told[-1].points
    assert np.linalg.norm(meant.mean(axis=0)[:2] - place[:2, 3]) < 0.01
    session.accept()
    assert session._decider.taken == [number]


def test_pointing_at_nothing_or_at_the_table_says_so(session):
    before = session.present
    assert not session.point(np.array([0.0, 0.3, 2.0]), np.array([0.0, 0.0, -1.0]))
    assert not session.point(np.array([0.0, 0.3, 2.0]), np.array([0.0, 0.0, 1.0]))
    assert session.present is before and session._decider.told == [None] and session.words


def test_a_choice_without_a_way_says_so_and_another_may_have_one():
    first = look(observed_scene()).choices[0].T_world_gripper
    session = Session(FakeDecider(), FakeWorld(fails=[first]))
    assert "unreachable" in session.present.problem and session.present.way is None
    session.choose(1)
    assert session.present.problem == ""
    assert np.allclose(session.present.way[-1], session.present.action.T_world_gripper[:3, 3])


def test_what_is_done_is_not_done_again_though_nothing_can_be_seen_afterwards(session):
    session._world.blind = True
    with pytest.raises(ConnectionError):
        session.accept()
    with pytest.raises(InvalidInput, match="look again"):
        session.accept()
    session._world.blind = False
    session.look()
    session.accept()
    assert session._decider.taken == [0, 0] and len(session.looks) == 3


def test_a_choice_without_a_way_is_not_accepted():
    session = Session(FakeDecider(), FakeWorld(fails=[look().choices[0].T_world_gripper]))
    with pytest.raises(InvalidInput, match="unreachable"):
        session.accept()
    assert session._world.performed == [] and session._decider.taken == []


def test_a_choice_that_is_not_there_is_refused(session):
    with pytest.raises(InvalidInput, match="choice"):
        session.choose(2)
    session.stop()
    assert session._world.stopped == 1
