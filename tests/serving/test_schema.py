import copy

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from imop.errors import InvalidInput
from imop.serving import schema, wire
from imop.serving.limits import Limits
from tests.serving.policies import Remembering, demonstrate, observe

LIMITS = Limits()


def sent(fields):
    return wire.unpack(wire.pack(fields))


def same_observation(a, b):
    assert a.views.keys() == b.views.keys()
    for name, view in a.views.items():
        for field in ("rgb", "depth", "intrinsics", "T_world_camera"):
            there, back = getattr(view, field), getattr(b.views[name], field)
            assert there.dtype == back.dtype and np.array_equal(there, back)
    assert np.array_equal(a.T_world_gripper, b.T_world_gripper)
    assert (a.gripper_opening, a.time_step) == (b.gripper_opening, b.time_step)
    assert np.array_equal(a.joint_positions, b.joint_positions)


def request(**changes):
    return {**sent(schema.observation_fields(observe())), **changes}


def test_an_observation_comes_back():
    observation = observe(0.25, 3)
    same_observation(observation, schema.to_observation(sent(schema.observation_fields(observation)), LIMITS))


def test_a_demonstration_comes_back_without_what_only_a_simulator_knows():
    shown = demonstrate(3)
    back = schema.to_demonstration(sent(schema.demonstration_fields(shown)), LIMITS)
    assert len(back) == 3 and back.instructions == shown.instructions and back.task == ""
    for a, b in zip(shown.keyframes, back.keyframes, strict=True):
        same_observation(a.observation, b.observation)
        assert np.array_equal(a.action.T_world_gripper, b.action.T_world_gripper)
        assert (a.action.gripper_open, a.action.allow_collisions) == (False, True)
        assert (b.action.gripper_open, b.action.allow_collisions) == (False, True)
    same_observation(shown.final, back.final)


def test_an_action_comes_back_with_its_evidence():
    action = Remembering().act(observe())
    back = schema.to_action(sent(schema.action_fields(action)))
    assert np.array_equal(action.T_world_gripper, back.T_world_gripper)
    for field in ("gripper_open", "allow_collisions", "confidence", "reachable"):
        assert getattr(action, field) == getattr(back, field)
    for field in ("step", "generator", "probability"):
        assert getattr(action.match, field) == getattr(back.match, field)
    for field in ("p_support", "p_query", "region", "T_query_support"):
        assert np.array_equal(getattr(action.match, field), getattr(back.match, field))


def test_no_privileged_field_is_sent():
    names = wire.pack(schema.demonstration_fields(demonstrate()))
    assert not [word for word in (b"instance", b"object", b"velocities", b"some/task") if word in names]


def test_the_servers_own_count_stands_in_for_a_time_step():
    fields = request()
    del fields["time_step"]
    assert schema.to_request(fields, LIMITS, time_step=4).observation.time_step == 4


@pytest.mark.parametrize("field", ["views", "T_world_gripper", "gripper_opening"])
def test_what_is_missing_is_named(field):
    fields = request()
    del fields[field]
    with pytest.raises(InvalidInput, match=f"{field}: is missing"):
        schema.to_request(fields, LIMITS)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"prompt": "open the drawer"}, "prompt"),
        ({"views": {}}, "views"),
        ({"views": []}, "views"),
        ({"views": {"x" * 200: {}}}, "views"),
        ({"gripper_opening": "open"}, "gripper_opening"),
        ({"gripper_opening": float("nan")}, "gripper_opening"),
        ({"gripper_opening": np.zeros(2)}, "gripper_opening"),
        ({"gripper_opening": 1.5}, "gripper_opening"),
        ({"T_world_gripper": 2 * np.eye(4)}, "T_world_gripper"),
        ({"T_world_gripper": "here"}, "T_world_gripper"),
        ({"joint_positions": np.full(7, np.nan)}, "joint_positions"),
        ({"time_step": -1}, "time_step"),
        ({"time_step": 1.5}, "time_step"),
        ({"time_step": float("nan")}, "time_step"),
        ({"time_step": float("inf")}, "time_step"),
        ({"reset": "yes"}, "reset"),
        ({"demonstrations": {}}, "demonstrations"),
        ({"demonstrations": [1]}, "demonstrations.0.demonstration"),
        ({"demonstrations": [{"keyframes": [], "final": {}}]}, "demonstrations.0.final.views"),
    ],
    ids=str,
)
def test_what_is_wrong_is_named(changes, named):
    with pytest.raises(InvalidInput) as refused:
        schema.to_request(request(**changes), LIMITS)
    assert refused.value.field == named


def test_depth_in_millimetres_is_noticed_by_its_type():
    fields = request()
    view = fields["views"]["front"]
    view["depth"] = (view["depth"] * 1000).astype(np.uint16)
    with pytest.raises(InvalidInput, match=r"views\.front\.depth.*metres"):
        schema.to_request(fields, LIMITS)


def test_more_points_or_keyframes_than_allowed_are_refused():
    with pytest.raises(InvalidInput, match="48 pixels; accepted: at most 47"):
        schema.to_request(request(), Limits(points=47))
    schema.to_request(request(), Limits(points=48))
    shown = [sent(schema.demonstration_fields(demonstrate(2)))] * 2
    with pytest.raises(InvalidInput, match="4 keyframes; accepted: at most 3"):
        schema.to_request({"demonstrations": shown}, Limits(keyframes=3))
    assert len(schema.to_request({"demonstrations": shown}, Limits(keyframes=4)).demonstrations) == 2


def test_an_empty_message_asks_for_nothing():
    with pytest.raises(InvalidInput, match="message: asks for nothing"):
        schema.to_request({}, LIMITS)
    assert schema.to_request({"reset": True}, LIMITS).observation is None


WHOLE = {
    "reset": False,
    "demonstrations": [sent(schema.demonstration_fields(demonstrate(1)))],
    **sent(schema.observation_fields(observe())),
}


def places(value, path=()):
    yield path
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, what in inner:
        yield from places(what, (*path, key))


WRONG = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(2**63), 2**64 - 1),
    st.floats(),
    st.text(max_size=5),
    st.binary(max_size=5),
    st.lists(st.none() | st.floats() | st.text(max_size=3) | st.lists(st.floats(), max_size=2), max_size=3),
    st.dictionaries(st.text(max_size=3) | st.binary(max_size=3), st.none(), max_size=2),
    st.sampled_from([np.zeros(0), np.zeros((4, 4)), np.full((4, 6), np.nan), np.zeros((2, 2, 2, 2), bool)]),
    st.sampled_from([np.float32(2), np.int8(-1), np.bool_(True), np.array(1e300), np.full((3, 3), -np.inf)]),
)


@given(st.sampled_from(list(places(WHOLE))[1:]), WRONG)
@settings(max_examples=150)
def test_any_field_with_any_value_is_read_or_refused(path, wrong):
    fields = copy.deepcopy(WHOLE)
    inner = fields
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = wrong
    try:
        schema.to_request(fields, LIMITS)
    except InvalidInput as refused:
        assert len(str(refused)) < 1_000
