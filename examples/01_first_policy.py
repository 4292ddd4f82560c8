"""Show a policy one demonstration, then let it act in a scene that it has not seen."""

import imop

TASK = "tabletop/open_drawer"

# The expert plays the person who demonstrates. Its scene has another seed than ours.
demonstration = imop.record_demonstration(imop.make_task(TASK), seed=100, instance_seed=0)

# The cameras see the arm; the self-filter knows which points are its own.
perception = imop.Perception(imop.panda_self_filter().is_robot)
policy = imop.OneShotPolicy.from_pretrained(perception=perception)
policy.watch(demonstration)

env = imop.make_env(TASK)
env.reset(seed=1, options={"instance_seed": 0})
policy.reset()
done = False
while not done:
    action = policy.act(env.observation)
    assert action.match is not None
    print(f"demonstrated step {action.match.step}: probability {action.confidence:.2f}")
    _, _, terminated, truncated, info = env.step(imop.to_array(action))
    done = terminated or truncated
print("success" if info["success"] else "failed")
