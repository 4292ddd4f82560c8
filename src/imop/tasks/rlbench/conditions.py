"""What has to be met for success. Conditions are made anew for every episode, for some remember."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

from imop.tasks.rlbench.scene import Scene


class Condition(Protocol):
    """Something that is met or not. All are asked every 0.05 s, whether others are met or not."""

    def met(self, scene: Scene) -> bool:
        """Whether it is met now."""
        ...


@dataclass(frozen=True)
class Detected:
    """A sensor detects a shape or a dummy, or, negated, does not."""

    thing: str
    sensor: str
    negated: bool = False

    def met(self, scene: Scene) -> bool:
        """Whether it is met now."""
        return scene.detects(self.sensor, self.thing) != self.negated


@dataclass(frozen=True)
class DetectedSeveral:
    """At least so many of these shapes or dummies are detected, each by any of these sensors."""

    things: tuple[str, ...]
    sensors: tuple[str, ...]
    count: int

    def met(self, scene: Scene) -> bool:
        """Whether it is met now."""
        found = [any(scene.detects(sensor, thing) for sensor in self.sensors) for thing in self.things]
        return sum(found) >= self.count


@dataclass(frozen=True)
class NothingGrasped:
    """Nothing is attached to the hand."""

    def met(self, scene: Scene) -> bool:
        """Whether it is met now."""
        return not scene.world.held


@dataclass(frozen=True)
class Grasped:
    """A body is attached to the hand."""

    body: str

    def met(self, scene: Scene) -> bool:
        """Whether it is met now."""
        return self.body in scene.world.held


@dataclass(frozen=True)
class JointMoved:
    """A joint is farther than `least` (radians or metres) from where the episode began, either way."""

    joint: str
    least: float

    def met(self, scene: Scene) -> bool:
        """Whether it is met now."""
        return scene.moved(self.joint) > self.least


@dataclass(frozen=True)
class AnyOf:
    """At least one of several."""

    conditions: Sequence[Condition]

    def met(self, scene: Scene) -> bool:
        """Whether it is met now."""
        return any([c.met(scene) for c in self.conditions])


@dataclass(frozen=True)
class AllOf:
    """All of several at once."""

    conditions: Sequence[Condition]

    def met(self, scene: Scene) -> bool:
        """Whether it is met now."""
        return all([c.met(scene) for c in self.conditions])


@dataclass
class InOrder:
    """Each of several was met after those before it; what has been met need not stay so."""

    conditions: Sequence[Condition]
    _reached: int = field(default=0, init=False)

    def met(self, scene: Scene) -> bool:
        """Whether it is met now."""
        while self._reached < len(self.conditions) and self.conditions[self._reached].met(scene):
            self._reached += 1
        return self._reached == len(self.conditions)
