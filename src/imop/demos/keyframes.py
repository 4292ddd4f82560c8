"""Which frames of a recorded episode are keyframes: where the robot did something, not how it got there."""

import numpy as np

from imop.errors import InvalidInput
from imop.geometry.se3 import rotation_distance, translation_distance
from imop.types import BoolArray, FloatArray, IntArray, as_finite

STOP_BUFFER = 4
SUDDEN = 5.0
"""A hand that was so many times as fast within three windows before and after has stopped."""


def published_keyframes(
    gripper_open: FloatArray | BoolArray, joint_velocities: FloatArray, at_rest: float = 0.1
) -> list[int]:
    """The rule that PerAct, RVT and Act3D share (from James et al., ARM).

    A frame is a keyframe if the gripper has just changed, or the joints are at rest while the gripper
    keeps its state, or it is the last one. Resting frames within the four after a resting keyframe do not
    count again. If the last two keyframes are neighbours, the first of the two is dropped.

    The original compares frame i with frames i - 1 and i - 2 by Python indices, so for i < 2 it looks at the
    *end* of the episode. It matters: an arm that starts at rest counts as stopped at frame 0 (which is never
    a keyframe but starts the buffer) only if the episode ends with the gripper in its first state. If it
    ends otherwise, frame 2 becomes a keyframe when the arm is still at rest there. This is reproduced.

    Args:
        gripper_open: (n,) state of the gripper in every frame.
        joint_velocities: (n, joints) radians per second.
        at_rest: largest speed of a resting joint, radians per second.

    Returns:
        Increasing frame numbers, none of them 0; empty for fewer than two frames.

    Raises:
        InvalidInput: if the lengths differ or a number is not finite.
    """
    state = as_finite("gripper_open", gripper_open, (None,))
    n = len(state)
    resting = np.all(np.abs(as_finite("joint_velocities", joint_velocities, (n, None))) <= at_rest, axis=1)
    keyframes: list[int] = []
    buffer = 0
    for i in range(n):
        stopped = (
            buffer <= 0
            and bool(resting[i])
            and i < n - 2
            and state[i] == state[i + 1] == state[i - 1] == state[i - 2]
        )
        buffer = STOP_BUFFER if stopped else buffer - 1
        if i > 0 and (stopped or state[i] != state[i - 1] or i == n - 1):
            keyframes.append(i)
    if len(keyframes) > 1 and keyframes[-2] == keyframes[-1] - 1:
        keyframes.pop(-2)
    return keyframes


def pose_keyframes(
    T_world_gripper: FloatArray,
    gripper_opening: FloatArray,
    times: FloatArray,
    *,
    window: float = 0.1,
    at_rest: tuple[float, float] = (0.03, 0.2),
    apart: tuple[float, float] = (0.01, 0.1),
    opening_change: float = 0.1,
) -> list[int]:
    """A rule for recordings without joint velocities: from where the gripper was, and when.

    The gripper rests where its displacement over a `window` is slower than `at_rest`. A stretch of rest gives
    one keyframe, the middle of its slowest window. A change of the opening gives one, the
    frame where the fingers have settled; it stands for the rest around it, because arms stand while
    grippers move. The last frame is one. Of consecutive keyframes whose poses are not `apart`, only a
    change of the opening counts, or else the last of them if the episode ends there.

    Args:
        T_world_gripper: (n, 4, 4).
        gripper_opening: (n,) 0 closed .. 1 open; measured, noise well below `opening_change` does no harm.
        times: (n,) seconds, strictly increasing; np.arange(n) * dt for a fixed rate.
        window: seconds.
        at_rest: metres per second and radians per second.
        apart: metres and radians.
        opening_change: fraction of the stroke.

    Returns:
        Increasing frame numbers, none of them 0; empty for fewer than two frames.

    Raises:
        InvalidInput: if the lengths differ, a number is not finite, or the times do not increase.
    """
    T = as_finite("T_world_gripper", T_world_gripper, (None, 4, 4))
    n = len(T)
    opening = as_finite("gripper_opening", gripper_opening, (n,))
    t = as_finite("times", times, (n,))
    if not np.all(np.diff(t) > 0):
        raise InvalidInput(
            "times", "not strictly increasing", "seconds, every frame later than the one before"
        )
    if n < 2:
        return []
    rest = _rests(T, t, window, at_rest)
    changes = _opening_changes(opening, t, window, opening_change)
    keyframes = [0]
    for i in sorted({*changes.values(), *_outside(rest, changes), n - 1}):
        nothing_new = not _apart(T[keyframes[-1]], T[i], apart)
        if nothing_new and i == n - 1 and len(keyframes) > 1:
            keyframes.pop()
        elif nothing_new and i != n - 1 and i not in changes.values():
            continue
        keyframes.append(i)
    return keyframes[1:]


def gripper_states(
    gripper_opening: FloatArray, times: FloatArray, *, window: float = 0.1, opening_change: float = 0.1
) -> BoolArray:
    """(n,) whether the gripper is open: whether its fingers opened or closed last.

    The opening alone does not say it, for fingers that hold something wide are far from closed. Before the
    first change the gripper is in the other state; if there is none, it is open from half of the stroke on.

    Args:
        gripper_opening: (n,) 0 closed .. 1 open; measured.
        times: (n,) seconds, strictly increasing.
        window: seconds.
        opening_change: fraction of the stroke.

    Raises:
        InvalidInput: if the lengths differ or a number is not finite.
    """
    opening = as_finite("gripper_opening", gripper_opening, (None,))
    t = as_finite("times", times, (len(opening),))
    states = np.full(len(opening), bool(len(opening)) and opening[0] > 0.5)
    for number, (start, end) in enumerate(_opening_changes(opening, t, window, opening_change).items()):
        opens = opening[end] > opening[max(start - 1, 0)]
        if number == 0:
            states[:start] = not opens
        states[start:] = opens
    return states


def _windows(t: FloatArray, window: float) -> IntArray:
    """(n - 1,) last frame of the window that begins at each frame but the last.

    It is no longer than `window`, unless frames are farther apart than that: a hand that turns back stands
    for a frame or two, and what it does before and after would hide that.
    """
    # Half a microsecond absorbs rounding: at a fixed rate every window then has equally many frames.
    after = np.searchsorted(t, t[:-1] + window + 5e-7, side="right") - 1
    return np.maximum(after, np.arange(1, len(t))).astype(np.int32)


def _rests(T: FloatArray, t: FloatArray, window: float, at_rest: tuple[float, float]) -> dict[int, range]:
    """Slowest frame of every stretch of rest -> the stretch."""
    before, after = np.arange(len(t) - 1), _windows(t, window)
    seconds = t[after] - t[before]
    speed = np.maximum(
        translation_distance(T[before], T[after]) / seconds / at_rest[0],
        rotation_distance(T[before], T[after]) / seconds / at_rest[1],
    )
    # A stretch ends only at twice the speed that makes it one, so that noise does not cut it into several.
    edges = np.flatnonzero(np.diff(np.concatenate([[False], speed < 2, [False]]).astype(np.int8)))
    rests = {}
    for first, end in edges.reshape(-1, 2).tolist():
        slowest = first + int(np.argmin(speed[first:end]))
        if speed[slowest] < 1 or _turns_back(speed, t, slowest, window):
            rests[int(before[slowest] + after[slowest] + 1) // 2] = range(first, int(after[end - 1]) + 1)
    return rests


def _turns_back(speed: FloatArray, t: FloatArray, slowest: int, window: float) -> bool:
    """Whether a hand that never quite rests was far faster just before and just after.

    Frames that are as far apart as a turn is long see a part of the way to it and a part of the way from it.
    """
    first, end = np.searchsorted(t[:-1], (t[slowest] - 3 * window, t[slowest] + 3 * window))
    fast = speed > SUDDEN * speed[slowest]
    return bool(np.any(fast[first:slowest]) and np.any(fast[slowest:end]))


def _opening_changes(opening: FloatArray, t: FloatArray, window: float, change: float) -> dict[int, int]:
    """Frame where the fingers left their former opening -> frame where they settled at another one."""
    changes: dict[int, int] = {}
    later = np.minimum(np.searchsorted(t, t + window), len(t) - 1)
    level, i = opening[0], 0
    while i < len(opening):
        if abs(opening[i] - level) > change:
            start = i
            while i < len(opening) - 1 and abs(opening[later[i]] - opening[i]) > change / 2:
                i += 1
            # What returns at once was pressed open by what is held, or is noise.
            if abs(opening[i] - level) > change:
                changes[start] = i
                level = opening[i]
        i += 1
    return changes


def _outside(rests: dict[int, range], changes: dict[int, int]) -> list[int]:
    """The rests that no change of the opening touches."""
    return [
        slowest
        for slowest, stretch in rests.items()
        if not any(start <= stretch.stop and stretch.start <= end + 1 for start, end in changes.items())
    ]


def _apart(T_a: FloatArray, T_b: FloatArray, apart: tuple[float, float]) -> bool:
    return bool(translation_distance(T_a, T_b) > apart[0] or rotation_distance(T_a, T_b) > apart[1])
