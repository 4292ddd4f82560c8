"""Make a demonstration of plain arrays, check it, and store it. The arrays come from the simulator here."""

import sys
from pathlib import Path

import imop
from imop.demos.check import check

recorded = imop.record_demonstration(imop.make_task("tabletop/open_drawer"), seed=100, instance_seed=0)


def observation_of(seen, number):
    """What imop asks of one moment: arrays, in the world frame, metres and radians."""
    views = {
        name: imop.CameraView(
            rgb=view.rgb,  # (H, W, 3) uint8
            depth=view.depth,  # (H, W) float32, metres along the optical axis, 0 where nothing was measured
            intrinsics=view.intrinsics,  # (3, 3) pixels
            T_world_camera=view.T_world_camera,  # (4, 4), x right, y down, z forward
        )
        for name, view in seen.views.items()
    }
    return imop.Observation(views, seen.T_world_gripper, seen.gripper_opening, number, seen.joint_positions)


# A keyframe is what was seen before a motion, and the pose and the fingers that the motion ended with.
keyframes = [
    imop.Keyframe(
        observation_of(k.observation, n), imop.Action(k.action.T_world_gripper, k.action.gripper_open)
    )
    for n, k in enumerate(recorded.keyframes)
]
final = observation_of(recorded.final, len(keyframes))
demonstration = imop.Demonstration(keyframes, final, task="mine/open_drawer")

store = imop.DemonstrationStore.create(Path(sys.argv[1]) / "mine.zarr")
store.append(demonstration)
print(f"{store.path}: a demonstration of {len(store[0])} steps")
for finding in check(store.path):
    print(finding)
