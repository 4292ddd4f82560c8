"""A converted model looks like the recorded one: RLBench's own depth images of open_drawer."""

import numpy as np
import pytest

from imop.demos.low_dim import LOW_DIM, read_frames
from imop.demos.rlbench import POLICY_CAMERAS, episodes, read_episode
from imop.geometry import se3
from imop.sim.cameras import render
from imop.tasks.coppelia.placing import place
from imop.tasks.coppelia.reader import read_file
from tests.tasks.coppelia.test_convert import world_of

FRAME = slice(0, 7)
OPENINGS = {"bottom": 14, "middle": 36, "top": 44}
"""Where the recorded state of the task holds the cabinet's pose and the drawers' positions."""
PARTS = (0, 2, 7, 9, 12)
"""Instance ids of the cabinet's parts, from the first one's."""
MEDIAN, NEAR = 0.004, 0.01
"""Metres."""


def cabinet(view, number):
    """Pixels of the cabinet in a recorded view of an episode."""
    return np.isin(view.instance_ids, 96 + 15 * number + np.array(PARTS))


@pytest.mark.parametrize("number", [1, 5, 9])
def test_depth_of_open_drawer(rlbench_models, rlbench_demos, number):
    model = read_file(rlbench_models / "open_drawer.ttm")
    (folder,) = [f for f in episodes(rlbench_demos) if f.name == f"episode{number}"]
    demonstration, frames = read_episode(folder), read_frames(folder / LOW_DIM)
    world = world_of(model)
    keyframes = {1: [0, 64, 77, 107], 5: [0, 59, 72, 95], 9: [0, 68, 80, 107]}[number]
    observations = [*(k.observation for k in demonstration.keyframes), demonstration.final]
    for i, observation in zip(keyframes, observations, strict=True):
        state = frames[i].numbers("task_low_dim_state", (101,))
        place(world, model, "drawer_frame", se3.from_pose7(state[FRAME]))
        for level, k in OPENINGS.items():
            world.set_joint(f"drawer_joint_{level}", state[k])
        world.set_robot(observation.joint_positions, observation.gripper_opening)
        ours = render(world)
        for name in POLICY_CAMERAS:
            recorded = observation.views[name]
            seen = cabinet(recorded, number)
            if seen.sum() < 200:
                continue  # hardly in the picture
            error = np.abs(recorded.depth[seen] - ours[name].depth[seen])
            assert np.median(error) < MEDIAN
            # The rest are edges, and sides that a camera grazes, where half a pixel is centimetres.
            assert np.mean(error < NEAR) > 0.65
