"""imop: a robot arm learns a manipulation task from one demonstration, without retraining."""

from imop.demos.load import load_demonstrations
from imop.demos.store import DemonstrationStore
from imop.errors import ImopError, InvalidInput, NoConfidentMatch, PlanFailed
from imop.geometry.perception import Perception
from imop.policy.one_shot import OneShotPolicy
from imop.policy.registration import RegistrationMatcher
from imop.sim.robot import panda_self_filter
from imop.tasks.env import make_env, make_task, to_array, to_observation
from imop.tasks.expert import record_demonstration
from imop.types import Action, CameraView, Demonstration, Keyframe, Observation

__all__ = [
    "Action",
    "CameraView",
    "Demonstration",
    "DemonstrationStore",
    "ImopError",
    "InvalidInput",
    "Keyframe",
    "NoConfidentMatch",
    "Observation",
    "OneShotPolicy",
    "Perception",
    "PlanFailed",
    "RegistrationMatcher",
    "load_demonstrations",
    "make_env",
    "make_task",
    "panda_self_filter",
    "record_demonstration",
    "to_array",
    "to_observation",
]
