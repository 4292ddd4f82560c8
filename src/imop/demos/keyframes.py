"""Which frames of a recorded episode are keyframes: where the robot did something, not how it got there."""

import numpy as np

from imop.types import BoolArray, FloatArray, as_array

STOP_BUFFER = 4


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
        InvalidInput: if the lengths differ.
    """
    state = as_array("gripper_open", gripper_open, (None,))
    n = len(state)
    resting = np.all(np.abs(as_array("joint_velocities", joint_velocities, (n, None))) <= at_rest, axis=1)
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
