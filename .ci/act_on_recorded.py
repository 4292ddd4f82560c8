"""What a policy is installed for, with the base alone: load weights, watch, act on recorded observations."""

import sys
from pathlib import Path

import numpy as np

from imop import OneShotPolicy, Perception, load_demonstrations, panda_self_filter
from imop.robots.panda import tip_pose

shown, recorded = load_demonstrations(Path(sys.argv[1]), 2)
policy = OneShotPolicy.from_pretrained(perception=Perception(panda_self_filter().is_robot))
policy.watch(shown)
policy.reset()
for keyframe in recorded.keyframes:
    action = policy.act(keyframe.observation)
    off = np.linalg.norm(action.T_world_gripper[:3, 3] - keyframe.action.T_world_gripper[:3, 3])
    print(f"step {keyframe.observation.time_step}: {100 * off:.1f} cm from the recorded action")
    assert off < 0.03
assert keyframe.observation.joint_positions is not None
tip = tip_pose(keyframe.observation.joint_positions)
assert np.allclose(tip, keyframe.observation.T_world_gripper, atol=0.005)
