"""Which gripper poses are as right as the recorded one.

A prediction is compared with the nearest pose of a set (`geometry/accuracy.py`), which contains besides the
recorded pose:

- Turns of the object that the step is fixed to, where they cannot be seen (`appearance`): a knob may be
  approached from any side.
- Turns of the object in the hand, where they cannot be seen: a cube may be put down a quarter turned.
- Half a turn of the gripper about its approach, while nothing is in the hand: the fingers have changed places
  and close on the same points. With something in the hand it would turn that too.
- The same pose at an object that looks the same, if the task uses both: the demonstration turns to it later,
  and to neither of them before this step. Equal objects that the task does not use are wrong, and so is an
  equal object once one of them was approached.
- If something else of its kind was demonstrated: the demonstrated pose in the frame of the step's object, as
  the oracle carries it over, with the turns above. The expert knows another shape and may go elsewhere.

Every step is judged alone, in the state that the expert left: a half turned grasp counts, and the next step
is asked from the expert's grasp again.
"""

import numpy as np

from imop.evaluation.appearance import Appearance
from imop.geometry import se3
from imop.types import Demonstration, FloatArray, Keyframe

EMPTY = 0.02
"""Below this opening closed fingers hold nothing."""


def equal_poses(
    recorded: Demonstration,
    step: int,
    appearance: Appearance | None,
    shown: Demonstration | None = None,
) -> FloatArray:
    """(N, 4, 4) T_world_gripper of all right poses of a step, the recorded one first.

    Args:
        recorded: with the privileged object names and poses.
        step: number of the keyframe.
        appearance: of the recorded scene's objects; without it only the recorded pose is right.
        shown: what was demonstrated, if it was with other objects of the same kind.
    """
    keyframe = recorded.keyframes[step]
    T_world_gripper = keyframe.action.T_world_gripper[None]
    if appearance is None or keyframe.object_name is None or keyframe.T_world_object is None:
        return T_world_gripper
    T_world_object = keyframe.T_world_object
    if shown is not None and step < len(shown):
        T_world_gripper = np.concatenate([T_world_gripper, _carried(shown.keyframes[step], keyframe)])
    turned = T_world_object @ appearance.turns(keyframe.object_name) @ se3.invert(T_world_object)
    in_hand = _in_hand(recorded, step, appearance)
    T_world_gripper = (turned[:, None, None] @ T_world_gripper[:, None] @ in_hand).reshape(-1, 4, 4)
    others = [
        T_world_other @ se3.invert(T_world_object) for T_world_other in _equals(recorded, step, appearance)
    ]
    return np.concatenate([T_world_gripper, *(T @ T_world_gripper for T in others)])


def _carried(shown: Keyframe, keyframe: Keyframe) -> FloatArray:
    """(1, 4, 4) the demonstrated pose at a keyframe's object; (0, 4, 4) if it was fixed to another one."""
    if shown.T_world_object is None or keyframe.T_world_object is None:
        return np.zeros((0, 4, 4))
    if shown.object_name != keyframe.object_name:
        return np.zeros((0, 4, 4))
    T_object_gripper = se3.invert(shown.T_world_object) @ shown.action.T_world_gripper
    return np.asarray((keyframe.T_world_object @ T_object_gripper)[None])


def held(recorded: Demonstration, step: int) -> int | None:
    """The step that closed the fingers on what they hold at the beginning of `step`; None if nothing."""
    opened = [k for k in range(step) if recorded.keyframes[k].action.gripper_open]
    first = opened[-1] + 1 if opened else 0
    empty = recorded.keyframes[step].observation.gripper_opening < EMPTY
    return None if first >= step or empty else first


def _in_hand(recorded: Demonstration, step: int, appearance: Appearance) -> FloatArray:
    """(N, 4, 4) motions of the gripper, in its own frame, that change nothing that can be seen."""
    closing = held(recorded, step)
    if closing is None:
        return np.stack([np.eye(4), se3.make(se3.euler(z=np.pi))])
    grasp = recorded.keyframes[closing]
    if grasp.object_name is None or grasp.T_world_object is None:
        return np.eye(4)[None]
    T_gripper_object = se3.invert(grasp.action.T_world_gripper) @ grasp.T_world_object
    return np.asarray(T_gripper_object @ appearance.turns(grasp.object_name) @ se3.invert(T_gripper_object))


def _equals(recorded: Demonstration, step: int, appearance: Appearance) -> list[FloatArray]:
    """T_world_object of the other objects that may be taken instead of the step's own."""
    name = recorded.keyframes[step].object_name
    assert name is not None
    used = {k.object_name for k in recorded.keyframes[:step]}
    later = {k.object_name: k.T_world_object for k in reversed(recorded.keyframes[step + 1 :])}
    return [
        T
        for other, T in later.items()
        if other is not None and T is not None and name not in used and other not in used | {name}
        if appearance.alike(name, other)
    ]
