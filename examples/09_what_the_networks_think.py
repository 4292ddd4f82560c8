"""Look inside: the invariant region of every step, and what else the policy might do, before it acts."""

import numpy as np

from imop import OneShotPolicy, Perception, make_env, make_task, panda_self_filter, record_demonstration

TASK = "tabletop/stack_cubes"
policy = OneShotPolicy.from_pretrained(perception=Perception(panda_self_filter().is_robot))
policy.watch(record_demonstration(make_task(TASK), seed=100, instance_seed=0))

for number, (step, prepared) in enumerate(policy.steps()):
    T_gripper_world = np.linalg.inv(step.action.T_world_gripper)
    p_gripper = prepared.region @ T_gripper_world[:3, :3].T + T_gripper_world[:3, 3]
    near = np.linalg.norm(p_gripper, axis=1).min()
    spread = np.median(prepared.spread)
    print(
        f"step {number}: region of {len(p_gripper)} points, {100 * near:.1f} cm from the gripper,"
        f" on other things {1000 * spread:.0f} mm elsewhere"
    )

env = make_env(TASK)
env.reset(seed=1, options={"instance_seed": 0})
decision = policy.decide(env.observation)  # nothing is done yet
for candidate in decision.candidates[:5]:
    moved = candidate.T_query_support[:3, 3].round(3)
    print(f"probability {candidate.probability:.2f}, by {candidate.generator}: moved by {moved} m")
policy.take(decision)  # its action is performed: the episode goes on from there
