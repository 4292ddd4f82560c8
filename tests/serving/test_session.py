import numpy as np
import pytest

from imop.geometry.focus import Focus
from imop.serving import schema, wire
from imop.serving.limits import Limits
from imop.serving.session import Outcome, Session
from tests.serving.policies import BUG, UNSURE, Plain, Remembering, demonstrate
from tests.serving.running import message, place


@pytest.fixture
def session():
    return Session(Remembering, Remembering(), 1, Limits())


def answer(session, *args, **more):
    reply = session.reply(message(*args, **more), {"wait_ms": 1.0})
    assert reply.outcome is Outcome.ANSWERED, reply.content.decode()
    return wire.unpack(reply.content)


def test_an_episode_goes_on_until_it_is_reset(session):
    assert place(answer(session, 0.5)) == [0.5, 1, 0]
    assert place(answer(session, 0.25)) == [0.75, 2, 0]
    assert place(answer(session, 1.0, reset=True)) == [1.0, 1, 0]
    assert "T_world_gripper" not in wire.unpack(session.reply(wire.pack({"reset": True}), {}).content)
    assert place(answer(session, 0.5)) == [0.5, 1, 0]


def test_demonstrations_stand_in_for_what_was_watched_and_begin_an_episode(session):
    shown = schema.demonstration_fields(demonstrate())
    answer(session)
    assert place(answer(session, demonstrations=[shown, shown])) == [0.5, 1, 2]
    assert place(answer(session)) == [1.0, 2, 2]
    assert place(answer(session, demonstrations=[shown])) == [0.5, 1, 1]


def test_a_session_without_demonstrations_says_so():
    reply = Session(Remembering, Remembering(), 0, Limits()).reply(message(), {})
    assert reply.outcome is Outcome.FAILED and b"InvalidInput: demonstrations: none" in reply.content


def test_low_confidence_leaves_the_episode_as_it_is(session):
    answer(session, 0.5)
    reply = session.reply(message(time_step=UNSURE), {})
    assert reply.outcome is Outcome.REFUSED
    last = reply.content.decode().strip().splitlines()[-1]
    assert last == "imop.errors.NoConfidentMatch: confidence: 0.25 is below the required 0.50"
    assert place(answer(session, 0.5)) == [1.0, 2, 0]


def test_a_bug_of_the_policy_is_told_by_its_traceback(session):
    reply = session.reply(message(time_step=BUG), {})
    assert reply.outcome is Outcome.FAILED
    assert b"Traceback" in reply.content and b"a bug of the policy" in reply.content


def test_a_reply_has_the_pose_as_a_row_and_the_time_it_took(session):
    reply = answer(session, 0.5)
    assert np.array_equal(reply["actions"], [[0.5, 1, 0, 0, 0, 0, 1, 0, 1]])
    assert reply["server_timing"]["wait_ms"] == 1.0 and reply["server_timing"]["infer_ms"] > 0


def test_the_policy_is_told_what_is_meant():
    policy = Remembering()
    session = Session(Remembering, policy, 1, Limits())
    mask = np.eye(4, 6, dtype=bool)
    focus = Focus({"front": mask}, [[1, 2, 3]], [[0, 0, 0], [1, 1, 1]])
    answer(session, focus=schema.focus_fields(focus))
    assert np.array_equal(policy.meant.masks["front"], mask)
    assert np.array_equal(policy.meant.points, focus.points) and np.array_equal(policy.meant.box, focus.box)
    answer(session)
    assert policy.meant is None


@pytest.mark.parametrize(
    ("make", "focus", "said"),
    [
        (Plain, {"points": np.zeros((1, 3))}, "focus: this server's policy takes none"),
        (Remembering, {}, "focus.focus: says nothing"),
        (Remembering, {"masks": {"front": "all"}}, "focus.front: "),
        (Remembering, {"box": np.zeros((3, 3))}, "focus.box: shape"),
        (Remembering, {"click": [1, 2]}, "focus.click: is no field"),
    ],
)
def test_what_is_wrong_with_a_focus_is_named(make, focus, said):
    reply = Session(make, make(), 1, Limits()).reply(message(focus=focus), {})
    assert reply.outcome is Outcome.FAILED and said in reply.content.decode().strip().splitlines()[-1]
