"""A converted model looks like the recorded one: RLBench's own depth images of open_drawer.

CoppeliaSim looks through the middle of a pixel, (u + 0.5, v + 0.5), while the recorded intrinsics belong to
its corner; and it pushes all surfaces back by half of what their inverse depth changes from pixel to pixel
(glPolygonOffset with factor 0.5). For a horizontal surface the two cancel, as if there were no such thing;
upright ones appear some millimetres too far away.
"""

from dataclasses import dataclass

import numpy as np
import pytest

from imop.demos.low_dim import LOW_DIM, read_frames
from imop.demos.rlbench import POLICY_CAMERAS, episodes, read_episode
from imop.geometry import se3
from imop.sim.cameras import CAMERAS, Camera, render
from imop.tasks.coppelia.placing import place
from imop.tasks.coppelia.reader import read_file
from tests.tasks.coppelia.test_convert import world_of

FRAME = slice(0, 7)
OPENINGS = {"bottom": 14, "middle": 36, "top": 44}
"""Where the recorded state of the task holds the cabinet's pose and the drawers' positions."""
PARTS = (0, 2, 7, 9, 12)
"""Instance ids of the cabinet's parts, from the first one's."""
KEYFRAMES = {1: (0, 64, 77, 107), 5: (0, 59, 72, 95), 9: (0, 68, 80, 107)}
FACTOR = 0.5


@dataclass(frozen=True, eq=False)
class Shifted(Camera):
    """A camera that looks through another place of each pixel."""

    shift: tuple[float, float] = (0.0, 0.0)

    def intrinsics(self, width, height):
        K = super().intrinsics(width, height)
        K[:2, 2] -= self.shift
        return K


def inverse_depth(world, observation, shift):
    # Where the cameras were: the one on the hand is a millimetre off where our arm would hold it.
    where = {n: view.T_world_camera for n, view in observation.views.items()}
    optics = {n: (CAMERAS[n].field_of_view, CAMERAS[n].far) for n in where}
    cameras = {n: Shifted(T, *optics[n], shift=shift) for n, T in where.items()}
    views = render(world, cameras=cameras)
    return {n: 1 / np.where(v.depth > 0, v.depth.astype(np.float64), np.inf) for n, v in views.items()}


def as_recorded(world, observation):
    """Depth images as CoppeliaSim makes them."""
    centre = inverse_depth(world, observation, (0.5, 0.5))
    steps = [
        # Of the steps to both sides the smaller, for one may lead over an edge.
        [inverse_depth(world, observation, (0.5 + a * h, 0.5 + b * h)) for h in (-0.2, 0.2)]
        for a, b in ((1, 0), (0, 1))
    ]
    depth = {}
    for n, z in centre.items():
        slopes = [np.minimum(abs(low[n] - z), abs(high[n] - z)) / 0.2 for low, high in steps]
        depth[n] = 1 / np.maximum(z - FACTOR * np.maximum(*slopes), 1e-3)
    return depth


@pytest.mark.parametrize("number", KEYFRAMES)
def test_depth_of_open_drawer(rlbench_models, rlbench_demos, number):
    model = read_file(rlbench_models / "open_drawer.ttm")
    (folder,) = [f for f in episodes(rlbench_demos) if f.name == f"episode{number}"]
    demonstration, frames = read_episode(folder), read_frames(folder / LOW_DIM)
    world = world_of(model)
    cabinet = np.flatnonzero([world.model.body(i).name in model.index for i in range(world.model.nbody)])
    things = np.unique(world.instances[cabinet])
    observations = [*(k.observation for k in demonstration.keyframes), demonstration.final]
    for i, observation in zip(KEYFRAMES[number], observations, strict=True):
        state = frames[i].numbers("task_low_dim_state", (101,))
        place(world, model, "drawer_frame", se3.from_pose7(state[FRAME]))
        for level, k in OPENINGS.items():
            world.set_joint(f"drawer_joint_{level}", state[k])
        world.set_robot(observation.joint_positions, observation.gripper_opening)
        plain, corrected = render(world), as_recorded(world, observation)
        for name in POLICY_CAMERAS:
            recorded = observation.views[name]
            seen = np.isin(recorded.instance_ids, 96 + 15 * number + np.array(PARTS))
            seen &= np.isin(plain[name].instance_ids, things)  # our arm is not quite as thick as theirs
            assert seen.sum() > 800
            assert np.median(np.abs(recorded.depth - plain[name].depth)[seen]) < 0.004
            error = np.abs(recorded.depth - corrected[name])[seen]
            assert np.median(error) < 5e-5
            assert np.mean(error < 0.001) > 0.88  # the rest are edges
