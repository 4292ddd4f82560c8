"""Procedural objects: each function returns a `mujoco.MjSpec` part to attach to a scene.

A part has one uppermost body called "body", whose frame the docstring of the function describes.
Attached with the prefix "pot/" it is called "pot/body".
"""
