"""Check a task of one's own (my_task.py), then teach it by one demonstration."""

from imop import OneShotPolicy, Perception, check_task, panda_self_filter, record_demonstration, to_array
from imop.tasks.env import ImopEnv
from my_task import LiftBlock

for problem in check_task("my_task:LiftBlock"):
    print(problem)

policy = OneShotPolicy.from_pretrained(perception=Perception(panda_self_filter().is_robot))
policy.watch(record_demonstration(LiftBlock(), seed=0, instance_seed=0))

successes = 0
for seed in (1, 2):
    env = ImopEnv(LiftBlock())
    env.reset(seed=seed, options={"instance_seed": seed})  # other blocks than the one that was shown
    policy.reset()
    done = False
    while not done:
        _, _, terminated, truncated, info = env.step(to_array(policy.act(env.observation)))
        done = terminated or truncated
    successes += info["success"]
print(f"{successes} of 2 scenes")
