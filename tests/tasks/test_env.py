import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from hypothesis import given
from hypothesis import strategies as st

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.tasks.env import ImopEnv, make_env, make_task, to_action, to_array, to_observation
from imop.types import Action

LID = "tabletop/lid_off_pot"


@pytest.fixture(scope="module")
def env():
    return make_env(LID)


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_gymnasiums_checker_passes():
    check_env(make_env(LID, step_limit=3), skip_render_check=True)


def waypoint_action(env, step):
    waypoint = env.task.waypoints(env.world)[step]
    return to_array(Action(waypoint.target(env.world), waypoint.gripper_open, waypoint.allow_collisions))


def test_following_the_waypoints_is_rewarded_once_and_ends_the_episode(env):
    env.reset(seed=2)
    outcomes = [env.step(waypoint_action(env, step))[1:] for step in range(3)]
    assert [reward for reward, _, _, _ in outcomes] == [0, 0, 1]
    assert [terminated for _, terminated, _, _ in outcomes] == [False, False, True]
    assert outcomes[-1][3]["success"]


def test_the_dictionary_and_the_typed_observation_agree(env):
    observation, _ = env.reset(seed=2)
    typed = to_observation(observation)
    assert set(typed.views) == {"front", "left_shoulder", "right_shoulder", "wrist"}
    for name, view in typed.views.items():
        np.testing.assert_array_equal(view.depth, env.observation.views[name].depth)
        assert view.instance_ids is None
    assert env.observation.views["front"].instance_ids is not None
    np.testing.assert_array_equal(typed.T_world_gripper, env.world.T_world_gripper)
    assert typed.time_step == 0
    assert typed.joint_positions.shape == (7,)


@pytest.mark.parametrize(
    ("p", "reason"), [((2.0, 0, 1), "outside_workspace"), ((-0.26, 0.0, 0.76), "unreachable")]
)
def test_a_motion_that_cannot_be_planned_ends_the_episode_without_reward(env, p, reason):
    env.reset(seed=2)
    action = to_array(Action(se3.make(np.diag([1.0, -1.0, -1.0]), p), True))
    _, reward, terminated, truncated, info = env.step(action)
    assert (reward, terminated, truncated) == (0.0, True, False)
    assert info["plan_failed"] == reason


def test_with_a_second_try_the_episode_goes_on_from_the_same_state():
    env = ImopEnv(make_task(LID), second_try=True)
    env.reset(seed=2)
    before = env.world.save_state().physics
    action = to_array(Action(se3.make(np.diag([1.0, -1.0, -1.0]), (2.0, 0, 1)), True))
    _, reward, terminated, truncated, info = env.step(action)
    assert (reward, terminated, truncated) == (0.0, False, False) and info["plan_failed"]
    np.testing.assert_array_equal(env.world.save_state().physics, before)
    assert env.observation.time_step == 1
    assert [env.step(waypoint_action(env, step))[1] for step in range(3)][-1] == 1


def test_the_step_limit_truncates():
    env = make_env(LID, step_limit=2)
    env.reset(seed=2)
    first = env.step(waypoint_action(env, 0))
    second = env.step(waypoint_action(env, 0))
    assert (first[3], second[3]) == (False, True)


def test_seeds_and_options_make_the_scene():
    env = make_env("tabletop/open_drawer")
    assert env.reset(seed=3)[1]["instance_seed"] == 3
    info = env.reset(seed=3, options={"variation": 2, "instance_seed": 8})[1]
    assert (info["variation"], info["instance_seed"], info["seed"]) == (2, 8, 3)
    assert "top" in info["instructions"][0]
    with pytest.raises(InvalidInput, match="variations, variation"):
        make_env("tabletop/open_drawer").reset(options={"variations, variation": 1})
    with pytest.raises(InvalidInput, match=r"0 \.\. 2"):
        env.reset(seed=3, options={"variation": 3})


def test_episodes_without_a_seed_follow_from_the_first_seed(env):
    env.reset(seed=5)
    seeds = [env.reset()[1]["seed"] for _ in range(2)]
    env.reset(seed=5)
    assert seeds == [env.reset()[1]["seed"] for _ in range(2)]
    assert seeds[0] != seeds[1]


def test_an_unknown_task_lists_the_known_ones():
    with pytest.raises(InvalidInput, match="tabletop/lid_off_pot"):
        make_env("tabletop/lid_of_pot")


def test_nothing_can_be_done_before_the_first_reset():
    env = make_env(LID)
    with pytest.raises(InvalidInput, match="reset"):
        env.step(np.zeros(9))
    with pytest.raises(InvalidInput, match="reset"):
        _ = env.world


@given(
    p=st.tuples(*[st.floats(-1, 1)] * 3),
    q=st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1),
    flags=st.tuples(st.booleans(), st.booleans()),
    scale=st.floats(0.5, 2.0),
)
def test_actions_survive_the_round_trip_and_quaternions_of_any_length(p, q, flags, scale):
    array = np.concatenate([p, np.multiply(q, scale), flags])
    action = to_action(array)
    assert (action.gripper_open, action.allow_collisions) == flags
    again = to_action(to_array(action))
    np.testing.assert_allclose(again.T_world_gripper, action.T_world_gripper, atol=1e-9)
    np.testing.assert_allclose(to_array(action)[:3], p)


@pytest.mark.parametrize("array", [np.zeros(9), np.full(9, np.nan), np.ones(8)])
def test_malformed_actions_are_named(array):
    with pytest.raises(InvalidInput, match="action"):
        to_action(array)
