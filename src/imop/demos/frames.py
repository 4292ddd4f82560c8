"""Recordings in another world frame."""

from dataclasses import replace

from imop.types import Demonstration, FloatArray, Keyframe, Observation, as_pose


def moved(demonstration: Demonstration, T_new_world: FloatArray) -> Demonstration:
    """The same demonstration with every pose given in another frame.

    Args:
        demonstration: what is recorded.
        T_new_world: (4, 4) maps points of its world frame into the new one.

    Raises:
        InvalidInput: if `T_new_world` is no rigid transformation.
    """
    T = as_pose("T_new_world", T_new_world)
    keyframes = tuple(_moved_step(keyframe, T) for keyframe in demonstration.keyframes)
    return replace(demonstration, keyframes=keyframes, final=_moved(demonstration.final, T))


def _moved(observation: Observation, T: FloatArray) -> Observation:
    views = {n: replace(v, T_world_camera=T @ v.T_world_camera) for n, v in observation.views.items()}
    return replace(observation, views=views, T_world_gripper=T @ observation.T_world_gripper)


def _moved_step(keyframe: Keyframe, T: FloatArray) -> Keyframe:
    action, T_world_object = keyframe.action, keyframe.T_world_object
    return replace(
        keyframe,
        observation=_moved(keyframe.observation, T),
        action=replace(action, T_world_gripper=T @ action.T_world_gripper),
        T_world_object=None if T_world_object is None else T @ T_world_object,
    )
