"""What the buttons do: look, accept, reject, point at what is meant; one episode, without any drawing."""

from dataclasses import replace

from imop.errors import InvalidInput, PlanFailed
from imop.geometry.focus import Focus
from imop.types import FloatArray
from imop.viewing.deciders import Decider
from imop.viewing.look import Look
from imop.viewing.pick import thing_at
from imop.viewing.worlds import World


class Session:
    """An episode that goes on when somebody agrees. Used by one thread at a time, but for `stop`.

    Args:
        decider: says what might be done.
        world: where it would be done.

    Attributes:
        looks: what was decided at each step so far, as it was accepted; the last one is not done yet, unless
            the episode is over.
        over: whether the episode has ended.
        words: what happened last, for people.
        failed: whether what was accepted last was not done.
    """

    def __init__(self, decider: Decider, world: World) -> None:
        self._decider, self._world = decider, world
        self.looks: list[Look] = []
        self.over = self.failed = False
        self.words = ""
        decider.reset()
        self.looks.append(self._see(None))

    @property
    def present(self) -> Look:
        """The decision that is to be accepted or rejected."""
        return self.looks[-1]

    def look(self, focus: Focus | None = None) -> None:
        """Look anew, and decide anew.

        Args:
            focus: which thing is meant; by default nothing is said.

        Raises:
            InvalidInput: if the episode is over, or nobody can be told the focus.
            ImopError, ConnectionError: if nothing can be seen.
        """
        self._going_on()
        self.looks[-1] = self._see(focus)

    def choose(self, number: int) -> None:
        """Look at another choice.

        Raises:
            InvalidInput: if the episode is over, or there is no choice of that number.
        """
        self._going_on()
        self.looks[-1] = self._with_way(self.present.choose(number))

    def reject(self) -> None:
        """Not this one: the next choice is looked at, or none if all were rejected.

        Raises:
            InvalidInput: if the episode is over.
        """
        self._going_on()
        following = self.present.chosen + 1
        if following < len(self.present.choices):
            self.choose(following)
            self.words = f"rejected; this is choice {following + 1} of {len(self.present.choices)}"
        else:
            self.looks[-1] = replace(self.present, choices=(), ways=(), chosen=0, problem="all were rejected")
            self.words = "all were rejected: look again, or point at the thing that is meant"

    def point(self, origin: FloatArray, direction: FloatArray) -> bool:
        """Decide anew for the thing that a ray hits; whether it hits one.

        Args:
            origin: (3,) of the ray, world frame, metres.
            direction: (3,) of any length.

        Raises:
            InvalidInput: as `look`.
        """
        meant = thing_at(self.present.scene, origin, direction)
        if meant is None:
            self.words = "nothing stands there"
            return False
        self.look(Focus(points=meant))
        self.words = "decided anew for what was pointed at"
        return True

    def accept(self) -> None:
        """Do what is looked at, then look again.

        Raises:
            InvalidInput: if the episode is over, there is no choice, or no way to it is known.
            ImopError, ConnectionError: if it cannot be begun, or nothing can be seen afterwards.
        """
        self._going_on()
        action = self.present.action
        if action is None or self.present.way is None:
            raise InvalidInput("choice", self.present.problem, "look again, or point at what is meant")
        outcome = self._world.perform(action)
        self._decider.take(self.present.chosen)
        self.over, self.words, self.failed = outcome.over, outcome.words, outcome.failed is not None
        if not self.over:
            # What is done must not be done again, even if nothing can be seen now.
            self.looks.append(Look(self.present.scene, problem="nothing was seen since: look again"))
            self.looks[-1] = self._see(None)

    def stop(self) -> None:
        """Bring to rest what moves; may be called from any thread."""
        self._world.stop()

    def _going_on(self) -> None:
        if self.over:
            raise InvalidInput("episode", "it is over", "a new one")

    def _see(self, focus: Focus | None) -> Look:
        observation = self._world.observe()
        look = replace(self._decider.decide(observation, focus), known=self._world.known())
        return self._with_way(look)

    def _with_way(self, look: Look) -> Look:
        """With the way to what is looked at, planned once."""
        action = look.action
        ways = list(look.ways) + [None] * (len(look.choices) - len(look.ways))
        if action is None or ways[look.chosen] is not None:
            return look
        try:
            ways[look.chosen] = self._world.way(action)
        except PlanFailed as error:
            return replace(look, ways=tuple(ways), problem=str(error))
        return replace(look, ways=tuple(ways), problem="")
