"""A one-shot policy that is told the step: what is measured is the pose, not the choice of the step."""

from imop.policy.interfaces import BEGINNING, Progress
from imop.policy.one_shot import OneShotPolicy
from imop.types import Action, Observation


class Told:
    """Asks a policy that has watched one demonstration for one of its steps.

    The episode goes on as if every step had been done, whether or not it was found.

    Attributes:
        routed: the step that the policy itself would have chosen last; None before it was asked.
    """

    def __init__(self, policy: OneShotPolicy) -> None:
        self._policy, self._progress = policy, BEGINNING
        self.routed: int | None = None

    def reset(self) -> None:
        """A new episode begins."""
        self._policy.reset()
        self._progress, self.routed = BEGINNING, None

    def act(self, observation: Observation, step: int) -> Action:
        """The action of a step in what is seen now; errors are those of `OneShotPolicy.act`."""
        scene = self._policy.see(observation)
        self.routed = self._policy.router.options(scene)[0].step
        self._policy.router.took(0, step)
        action = self._policy.locate(scene, step, progress=self._progress)
        assert action.match is not None
        self._progress = Progress(action.match.T_query_support)
        return action
