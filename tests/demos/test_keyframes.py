import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from imop.demos import unpickle
from imop.demos.keyframes import gripper_states, pose_keyframes, published_keyframes
from imop.errors import InvalidInput
from imop.geometry import se3

# Frame numbers by the original implementation (docs/rlbench-demos.md of the shared notes).
PUBLISHED = {
    1: [64, 77, 107],
    2: [62, 75, 104],
    3: [68, 81, 113],
    4: [65, 80, 117],
    5: [59, 72, 95],
    6: [60, 73, 95],
    7: [63, 77, 104],
    9: [68, 80, 107],
}


def recorded(demos, episode):
    folder = demos / "open_drawer" / "all_variations" / "episodes" / f"episode{episode}"
    return [o.fields for o in unpickle.load(folder / "low_dim_obs.pkl").fields["_observations"]]


def moving(n: int) -> np.ndarray:
    return np.ones((n, 7))


def literal_rule(gripper, velocities, delta=0.1):
    """The rule as its definition reads, with the negative indices of Python lists."""
    found, buffer = [], 0
    for i in range(len(gripper)):
        stays = i < len(gripper) - 2 and (
            gripper[i] == gripper[i + 1] and gripper[i] == gripper[i - 1] and gripper[i - 2] == gripper[i - 1]
        )
        stopped = buffer <= 0 and np.allclose(velocities[i], 0, atol=delta) and stays
        buffer = 4 if stopped else buffer - 1
        changed = gripper[i] != gripper[i - 1]
        if i != 0 and (changed or i == len(gripper) - 1 or stopped):
            found.append(i)
    if len(found) > 1 and found[-1] - 1 == found[-2]:
        del found[-2]
    return found


@pytest.mark.parametrize("episode", PUBLISHED)
def test_real_demonstrations(rlbench_demos, episode):
    frames = recorded(rlbench_demos, episode)
    is_open = np.array([f["gripper_open"] for f in frames])
    velocities = np.array([f["joint_velocities"] for f in frames])
    assert published_keyframes(is_open, velocities) == PUBLISHED[episode]


@pytest.mark.parametrize("episode", PUBLISHED)
def test_poses_alone_find_the_same_steps(rlbench_demos, episode):
    frames = recorded(rlbench_demos, episode)
    T = np.array([f["gripper_matrix"] for f in frames])
    opening = np.array([f["gripper_joint_positions"].mean() / 0.04 for f in frames])
    found = pose_keyframes(T, opening, 0.05 * np.arange(len(frames)))
    assert len(found) == 3
    for i, j in zip(found, PUBLISHED[episode], strict=True):
        assert se3.translation_distance(T[i], T[j]) < 0.005
        assert se3.rotation_distance(T[i], T[j]) < np.deg2rad(1)


@given(st.data())
def test_equals_the_definition(data):
    n = data.draw(st.integers(0, 30))
    gripper = data.draw(st.lists(st.sampled_from([0.0, 1.0]), min_size=n, max_size=n))
    speeds = data.draw(st.lists(st.sampled_from([0.0, 0.0, 0.5]), min_size=n, max_size=n))
    velocities = np.array(speeds)[:, None] * np.ones((n, 7))
    assert published_keyframes(np.array(gripper), velocities) == literal_rule(gripper, velocities)


def test_negative_indices_look_at_the_end():
    velocities = moving(20)
    velocities[:3] = 0.0
    ends_as_begun = np.ones(20)
    ends_closed = np.where(np.arange(20) < 10, 1.0, 0.0)
    assert published_keyframes(ends_as_begun, velocities) == [19]
    assert published_keyframes(ends_closed, velocities) == [2, 10, 19]


def test_resting_frames_are_thinned_by_the_buffer():
    velocities = moving(40)
    velocities[10:21] = 0.05
    assert published_keyframes(np.ones(40), velocities) == [10, 15, 20, 39]


def test_one_resting_joint_is_not_enough():
    velocities = np.zeros((20, 7))
    velocities[:, 6] = -0.2
    assert published_keyframes(np.ones(20), velocities) == [19]


def test_neighbour_of_the_last_is_dropped():
    gripper = np.ones(10)
    gripper[8:] = 0
    assert published_keyframes(gripper, moving(10)) == [9]


@pytest.mark.parametrize("n", [0, 1])
def test_nothing_to_find(n):
    assert published_keyframes(np.ones(n), moving(n)) == []
    assert pose_keyframes(np.tile(np.eye(4), (n, 1, 1)), np.ones(n), np.arange(n, dtype=float)) == []


def minimum_jerk(seconds, rate):
    s = np.linspace(0, 1, round(seconds * rate) + 1)[1:]
    return 10 * s**3 - 15 * s**4 + 6 * s**5


def episode_at(rate, noise=0.0):
    """Move 1.5 s, stand 0.5 s, close 0.4 s, stand 0.2 s, lift 1 s, turn 90 degrees in 1 s, open, stand."""
    rng = np.random.default_rng(0)
    stand = lambda seconds: np.zeros(round(seconds * rate))  # noqa: E731
    p = np.concatenate(
        [[0], 0.4 * minimum_jerk(1.5, rate), 0.4 + stand(1.1), 0.4 + 0.2 * minimum_jerk(1, rate)]
    )
    p = np.concatenate([p, np.full(round(2.0 * rate), p[-1])])
    before_turn = round(3.6 * rate) + 1
    turn = np.concatenate([np.zeros(before_turn), np.pi / 2 * minimum_jerk(1, rate)])
    turn = np.concatenate([turn, np.full(len(p) - len(turn), turn[-1])])
    t = np.arange(len(p)) / rate
    opening = np.interp(t, [0, 2.0, 2.4, 4.9, 5.3, 9], [1, 1, 0.3, 0.3, 1, 1])
    T = se3.make(Rotation.from_rotvec(np.outer(turn, [0, 0, 1])).as_matrix(), np.outer(p, [1, 0, 0]))
    T[:, :3, 3] += noise * rng.standard_normal((len(p), 3))
    return T, opening + 0.01 * rng.standard_normal(len(p)) * (noise > 0), t


@pytest.mark.parametrize(("rate", "noise"), [(10, 0), (20, 0), (30, 0.0004), (100, 0.0004)])
def test_steps_of_a_known_episode(rate, noise):
    T, opening, t = episode_at(rate, noise)
    found = pose_keyframes(T, opening, t)
    # Grasped; lifted, before the turn; turned and released, the end.
    assert len(found) == 3
    assert 2.25 <= t[found[0]] <= 2.6
    assert t[found[1]] == pytest.approx(3.6, abs=0.2)
    assert found[2] == len(t) - 1


def test_uneven_times_are_respected():
    T, opening, t = episode_at(50)
    keep = np.sort(np.random.default_rng(1).choice(len(t), len(t) // 2, replace=False))
    found = pose_keyframes(T[keep], opening[keep], t[keep])
    whole = pose_keyframes(T, opening, t)
    assert t[keep][found] == pytest.approx(t[whole], abs=0.2)


def test_standing_still_is_one_step():
    n = 50
    assert pose_keyframes(np.tile(np.eye(4), (n, 1, 1)), np.ones(n), 0.05 * np.arange(n)) == [n - 1]


def there_and_back(phase, rate=15):
    """Stand, go 30 cm, turn back at once, go on; every frame `phase` of a period later."""
    t = (np.arange(4 * rate) + phase) / rate
    s = lambda begin: np.clip((t - begin) / 1.0, 0, 1)  # noqa: E731
    jerk = lambda u: 10 * u**3 - 15 * u**4 + 6 * u**5  # noqa: E731
    x = 0.3 * jerk(s(0.5)) - 0.3 * jerk(s(1.55)) + 0.2 * jerk(s(2.55))
    T = np.tile(np.eye(4), (len(t), 1, 1))
    T[:, 0, 3] = x
    return T, t


@given(st.floats(0, 1, exclude_max=True))
def test_a_hand_that_turns_back_between_frames_is_seen(phase):
    T, t = there_and_back(phase)
    found = pose_keyframes(T, np.ones(len(t)), t)
    assert len(found) == 3
    assert t[found[0]] == pytest.approx(1.5, abs=0.1) and t[found[1]] == pytest.approx(2.55, abs=0.1)


def test_fingers_that_are_pressed_open_for_a_moment_did_nothing():
    T, opening, t = episode_at(15)
    whole = pose_keyframes(T, opening, t)
    pressed = opening.copy()
    held = int(np.searchsorted(t, 3.0))
    pressed[held : held + 2] += 0.15
    assert pose_keyframes(T, pressed, t) == whole
    np.testing.assert_array_equal(gripper_states(pressed, t), gripper_states(opening, t))


@given(st.floats(0.2, 0.85), st.integers(0, 5))
def test_fingers_that_hold_something_wide_are_closed(width, seed):
    noise = 0.01 * np.random.default_rng(seed).standard_normal(60)
    t = np.arange(60) / 15
    states = gripper_states(np.interp(t, [0, 1, 1.3, 3, 3.3, 4], [1, 1, width, width, 1, 1]) + noise, t)
    assert states[t < 0.9].all() and not states[(t > 1.3) & (t < 2.9)].any() and states[t > 3.3].all()


def test_a_gripper_that_only_opens_was_closed():
    t = np.arange(30) / 15
    assert not gripper_states(np.interp(t, [0, 1, 1.2, 2], [0.7, 0.7, 1, 1]), t)[0]
    assert gripper_states(np.ones(5), np.arange(5.0)).all()
    assert not gripper_states(np.zeros(5), np.arange(5.0)).any()


def test_wrong_input_is_named():
    with pytest.raises(InvalidInput, match="joint_velocities"):
        published_keyframes(np.ones(5), moving(4))
    with pytest.raises(InvalidInput, match="gripper_opening"):
        pose_keyframes(np.tile(np.eye(4), (5, 1, 1)), np.ones(4), np.arange(5.0))
    with pytest.raises(InvalidInput, match="times"):
        pose_keyframes(np.tile(np.eye(4), (5, 1, 1)), np.ones(5), np.zeros(5))
