"""A matcher of one's own: the policy takes whatever finds the region of a demonstrated step again."""
# ruff: noqa: D102 (the methods are described in imop.policy.interfaces)

import numpy as np

from imop import OneShotPolicy, Perception, make_env, make_task, panda_self_filter, record_demonstration
from imop.geometry import se3
from imop.policy.interfaces import BEGINNING, Candidate


class MiddleStep:
    """The region is all that stands on the table. It is followed by its middle, and never turns."""

    spread = None

    def __init__(self, step):
        self.region = step.before.fused.points[~step.before.ground.bare]

    def locate(self, query, progress=BEGINNING, feasible=None):
        seen = query.fused.points[~query.ground.bare]
        x, y, _ = np.median(seen, axis=0) - np.median(self.region, axis=0)
        return (Candidate(se3.make(p=(x, y, 0.0)), probability=0.5, generator="middle"),)


class MiddleMatcher:
    """Prepares the steps of a demonstration."""

    def prepare(self, steps):
        return [MiddleStep(step) for step in steps]


policy = OneShotPolicy(MiddleMatcher(), Perception(panda_self_filter().is_robot))
policy.watch(record_demonstration(make_task("tabletop/open_drawer"), seed=100, instance_seed=0))
env = make_env("tabletop/open_drawer")
env.reset(seed=1, options={"instance_seed": 0})
action = policy.act(env.observation)
print(f"confidence {action.confidence}, gripper to {action.T_world_gripper[:3, 3].round(3)}")
