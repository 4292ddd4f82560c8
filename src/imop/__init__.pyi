from .demos.keyframes import pose_keyframes
from .demos.load import load_demonstrations
from .demos.store import DemonstrationStore
from .errors import ImopError, InvalidInput, NoConfidentMatch, PlanFailed
from .geometry.focus import Focus
from .geometry.perception import Perception
from .geometry.self_filter import SelfFilter
from .policy.learned import LearnedMatcher
from .policy.one_shot import OneShotPolicy
from .policy.registration import RegistrationMatcher
from .policy.router import LearnedRouter
from .recording.recorder import DemonstrationRecorder
from .robots.panda import panda_self_filter
from .setup.file import load_setup, save_setup
from .setup.setup import Setup
from .tasks.check_task import check_task
from .tasks.env import make_env, make_task, to_array, to_observation
from .tasks.expert import record_demonstration
from .tasks.task import Task
from .tasks.waypoint import Waypoint
from .types import Action, CameraView, Demonstration, Keyframe, Observation

__all__ = [
    "Action",
    "CameraView",
    "Demonstration",
    "DemonstrationRecorder",
    "DemonstrationStore",
    "Focus",
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
    "SelfFilter",
    "Setup",
    "Task",
    "Waypoint",
    "check_task",
    "load_demonstrations",
    "load_setup",
    "make_env",
    "make_task",
    "panda_self_filter",
    "pose_keyframes",
    "record_demonstration",
    "save_setup",
    "to_array",
    "to_observation",
]
