from .demos.load import load_demonstrations
from .demos.store import DemonstrationStore
from .errors import ImopError, InvalidInput, NoConfidentMatch, PlanFailed
from .geometry.perception import Perception
from .policy.learned import LearnedMatcher
from .policy.learned_router import LearnedRouter
from .policy.one_shot import OneShotPolicy
from .policy.registration import RegistrationMatcher
from .robots.panda import panda_self_filter
from .tasks.env import make_env, make_task, to_array, to_observation
from .tasks.expert import record_demonstration
from .types import Action, CameraView, Demonstration, Keyframe, Observation

__all__ = [
    "Action",
    "CameraView",
    "Demonstration",
    "DemonstrationStore",
    "ImopError",
    "InvalidInput",
    "Keyframe",
    "LearnedMatcher",
    "LearnedRouter",
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
