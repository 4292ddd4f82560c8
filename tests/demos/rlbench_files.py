"""Writes a demonstration the way RLBench does, with pickles of classes that are not there to read them."""

import pickle
import sys
import types
from pathlib import Path
from unittest import mock

import numpy as np
from PIL import Image
from scipy.spatial.transform import Rotation, Slerp

from imop.demos.low_dim import JOINT_4_OFFSET
from imop.geometry import se3
from imop.types import Demonstration

NEAR, FAR = 0.01, 4.5
PER_STEP = 20
KEYFRAMES = [PER_STEP, 2 * PER_STEP, 3 * PER_STEP]


def rlbench_classes() -> tuple[dict[str, types.ModuleType], type, type]:
    """Modules, Demo class and Observation class that pickle by RLBench's names."""

    class Demo:
        pass

    class Observation:
        pass

    modules = {
        name: types.ModuleType(name)
        for name in ("rlbench", "rlbench.demo", "rlbench.backend", "rlbench.backend.observation")
    }
    Demo.__module__, Demo.__qualname__ = "rlbench.demo", "Demo"
    Observation.__module__, Observation.__qualname__ = "rlbench.backend.observation", "Observation"
    modules["rlbench.demo"].Demo = Demo
    modules["rlbench.backend.observation"].Observation = Observation
    return modules, Demo, Observation


def dump_demo(path: Path, frames: list[dict]) -> None:
    modules, Demo, Observation = rlbench_classes()
    demo = Demo()
    demo._observations = []
    for fields in frames:
        observation = Observation()
        observation.__dict__.update(fields)
        demo._observations.append(observation)
    demo.variation_number = 0
    with mock.patch.dict(sys.modules, modules):
        path.write_bytes(pickle.dumps(demo, protocol=4))


def frames_of(demonstration: Demonstration) -> list[dict]:
    """The numbers of every frame, keyframes at `KEYFRAMES`, smooth motion between them."""
    seen = [*(k.observation for k in demonstration.keyframes), demonstration.final]
    frames = []
    for i in range(PER_STEP * len(demonstration) + 1):
        k, rest = divmod(i, PER_STEP)
        s = rest / PER_STEP
        a, b = seen[k], seen[min(k + 1, len(seen) - 1)]
        s = 10 * s**3 - 15 * s**4 + 6 * s**5
        rotations = Rotation.from_matrix([a.T_world_gripper[:3, :3], b.T_world_gripper[:3, :3]])
        T = se3.make(
            Slerp([0, 1], rotations)(s).as_matrix(),
            (1 - s) * a.T_world_gripper[:3, 3] + s * b.T_world_gripper[:3, 3],
        )
        action = demonstration.keyframes[max(k - 1, 0)].action
        q = (1 - s) * a.joint_positions + s * b.joint_positions
        q[3] -= JOINT_4_OFFSET
        misc = {}
        for name, view in a.views.items():
            misc |= {
                f"{name}_camera_extrinsics": view.T_world_camera @ np.diag([-1.0, -1.0, 1.0, 1.0]),
                f"{name}_camera_intrinsics": view.intrinsics * [[-1, 1, 1], [1, -1, 1], [1, 1, 1]],
                f"{name}_camera_near": NEAR,
                f"{name}_camera_far": FAR,
            }
        frames.append(
            {
                "gripper_open": float(action.gripper_open) if k else 1.0,
                "gripper_pose": se3.to_pose7(T),
                "gripper_matrix": T,
                "gripper_joint_positions": np.full(2, 0.04 * a.gripper_opening),
                "joint_positions": q,
                "joint_velocities": np.full(7, 0.5 if rest else 0.0),
                "ignore_collisions": np.array(action.allow_collisions and k == len(demonstration)),
                "task_low_dim_state": np.zeros(3),
                "misc": misc,
            }
        )
    return frames


def write_episode(folder: Path, demonstration: Demonstration, frames: list[dict] | None = None) -> Path:
    """An episode folder with images of frame 0 and the keyframes only."""
    folder.mkdir(parents=True)
    dump_demo(folder / "low_dim_obs.pkl", frames_of(demonstration) if frames is None else frames)
    (folder / "variation_number.pkl").write_bytes(pickle.dumps(demonstration.variation, protocol=4))
    words = pickle.dumps(list(demonstration.instructions), protocol=4)
    (folder / "variation_descriptions.pkl").write_bytes(words)
    seen = [*(k.observation for k in demonstration.keyframes), demonstration.final]
    for i, observation in zip([0, *KEYFRAMES], seen, strict=True):
        for name, view in observation.views.items():
            fraction = np.where(view.measured, (view.depth.astype(float) - NEAR) / (FAR - NEAR), 1.0)
            code = np.rint(fraction * (2**24 - 1)).astype(int)
            depth = np.stack([code // 65536, code // 256 % 256, code % 256], axis=-1)
            ids = view.instance_ids
            mask = np.stack([ids % 256, ids // 256 % 256, ids // 65536], axis=-1)
            for kind, pixels in (("rgb", view.rgb), ("depth", depth), ("mask", mask)):
                target = folder / f"{name}_{kind}"
                target.mkdir(exist_ok=True)
                Image.fromarray(pixels.astype(np.uint8)).save(target / f"{i}.png")
    return folder
