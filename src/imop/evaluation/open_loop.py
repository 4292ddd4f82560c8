"""Prediction on recorded data: what would the policy have done in each recorded state?"""

import time
from dataclasses import dataclass

from imop.evaluation.rollout import Policy
from imop.geometry import se3
from imop.types import Action, Demonstration


@dataclass(frozen=True)
class Prediction:
    """One predicted action beside the recorded one.

    Attributes:
        step: number of the recorded keyframe.
        action: what the policy predicted.
        position_error: metres to the recorded gripper position.
        rotation_error: radians to the recorded gripper orientation.
        seconds: time to decide.
    """

    step: int
    action: Action
    position_error: float
    rotation_error: float
    seconds: float

    @property
    def within_1cm_5deg(self) -> bool:
        """Whether the prediction is near enough for most grasps."""
        return self.position_error < 0.01 and self.rotation_error < 0.0872665


def predict(policy: Policy, recorded: Demonstration) -> list[Prediction]:
    """Ask the policy, which has watched another demonstration, for the action at every recorded keyframe.

    Raises:
        ImopError: as the policy does.
    """
    policy.reset()
    predictions = []
    for step, keyframe in enumerate(recorded.keyframes):
        started = time.perf_counter()
        action = policy.act(keyframe.observation.stripped())
        seconds = time.perf_counter() - started
        predictions.append(
            Prediction(
                step,
                action,
                float(se3.translation_distance(action.T_world_gripper, keyframe.action.T_world_gripper)),
                float(se3.rotation_distance(action.T_world_gripper, keyframe.action.T_world_gripper)),
                seconds,
            )
        )
    return predictions
