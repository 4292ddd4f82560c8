"""How the policy sees the takes of procedural scenes, through cameras that may be said to be elsewhere."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from imop.geometry.perception import Perception
from imop.geometry.view_alignment import corrected, find_errors
from imop.policy.interfaces import Scene, Transition
from imop.robots.panda import panda_self_filter
from imop.sim.sensing import calibration_error
from imop.training.data.executed import AnyDemonstration
from imop.types import FloatArray, Observation

# How far misplaced cameras are off, metres and radians.
WRONG = (0.003, 0.009)
_PERCEPTION = Perception(panda_self_filter().is_robot)


@dataclass(frozen=True, eq=False)
class SetUp:
    """Cameras that may be said to be somewhere else, and what is found out about that.

    Attributes:
        T_camera_told: camera -> (4, 4) where it is said to be, in its true frame; none if they are right.
        errors: as the policy finds them from the demonstration.
    """

    T_camera_told: Mapping[str, FloatArray] = field(default_factory=dict)
    errors: dict[str, FloatArray] = field(default_factory=dict)

    @classmethod
    def misplaced(cls, shown: AnyDemonstration, rng: np.random.Generator) -> "SetUp":
        """A set-up in which a demonstration was given and every camera is off."""
        told = {name: calibration_error(rng, *WRONG) for name in shown.observations[0].views}
        return cls(told, find_errors([corrected(o, told) for o in shown.observations]))

    def see(self, observation: Observation) -> Scene:
        """As the policy sees it, without names of objects."""
        seen = corrected(corrected(observation.stripped(), self.T_camera_told), self.errors)
        return Scene(seen, _PERCEPTION.points(seen))

    def transitions(self, shown: AnyDemonstration) -> list[Transition]:
        """The steps of a demonstration."""
        scenes = [self.see(observation) for observation in shown.observations]
        return [Transition(scenes[k], scenes[k + 1], action) for k, action in enumerate(shown.actions)]
