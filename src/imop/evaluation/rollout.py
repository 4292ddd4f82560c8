"""One episode of one policy in one scene."""

import time
from collections.abc import Callable

from imop.errors import NoConfidentMatch
from imop.evaluation.methods import Policy
from imop.evaluation.pointing import Pointing
from imop.evaluation.steps import Rollout, Step
from imop.geometry.accuracy import errors
from imop.policy.one_shot import OneShotPolicy
from imop.tasks.env import ImopEnv, to_array
from imop.types import Action, FloatArray, Observation


def rollout(
    env: ImopEnv,
    policy: Policy,
    steps: int,
    expert_poses: Callable[[int], FloatArray | None] = lambda step: None,
    on_action: Callable[[Observation, Action], None] = lambda observation, action: None,
    point: Pointing | None = None,
) -> Rollout:
    """Act until success, failure or `steps` actions, in an environment that was just reset.

    A one-shot policy recovers where the environment lets it try again.

    Args:
        env: the environment.
        policy: has watched its demonstrations.
        steps: most actions allowed.
        expert_poses: (N, 4, 4) T_world_gripper that are right for the step of the given number, from the
            state now.
        on_action: called before each action is executed.
        point: tells a one-shot policy which thing is meant; by default nobody does.
    """
    if isinstance(policy, OneShotPolicy):
        policy.recovers = env.second_try
    policy.reset()
    taken: list[Step] = []
    for number in range(steps):
        observation = env.observation.stripped()
        started = time.perf_counter()
        try:
            if point is None:
                action = policy.act(observation)
            else:
                assert isinstance(policy, OneShotPolicy)
                action = policy.act(observation, point(number, env.observation))
        except NoConfidentMatch:
            return Rollout(False, "no confident match", tuple(taken))
        decided = time.perf_counter()
        support_step = action.match.step if action.match else None
        right = expert_poses(number if support_step is None else support_step)
        position, rotation = (None, None) if right is None else errors(action.T_world_gripper, right)
        on_action(observation, action)
        _, _, terminated, truncated, info = env.step(to_array(action))
        taken.append(
            Step(
                support_step,
                position,
                rotation,
                action.confidence,
                decided - started,
                time.perf_counter() - decided,
                info.get("plan_failed"),
                action.match.generator if action.match else "",
                action.reachable,
                bool(info.get("disturbed")),
            )
        )
        if info.get("success"):
            return Rollout(True, "success", tuple(taken))
        if terminated:
            return Rollout(False, f"no motion ({info['plan_failed']})", tuple(taken))
        if truncated:
            break
    if taken and env.wait():
        return Rollout(True, "success", tuple(taken))
    return Rollout(False, "task not done after the last action", tuple(taken))
