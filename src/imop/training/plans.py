"""What a random scene is made of: things that something is done with, and things that distract."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from imop.training.families.redraw import redrawn
from imop.training.families.thing import Family, Thing
from imop.training.stage import Unreachable

MOST_THINGS = 8


class Draw(NamedTuple):
    """How a thing was drawn: equal draws are indistinguishable things.

    Attributes:
        family: its name.
        shape, color: seeds.
        sizes: seed of other sizes for that shape, or None.
    """

    family: str
    shape: int
    color: int
    sizes: int | None = None

    def thing(self, families: Mapping[str, Family]) -> Thing:
        """Draw it again.

        Raises:
            Diverged: if the shape has no other sizes.
        """
        family = families[self.family]
        if self.sizes is None:
            return family(np.random.default_rng(self.shape), np.random.default_rng(self.color))
        return redrawn(family, self.shape, self.color, self.sizes)


Part = tuple[str, int, int, int]
"""What is done, with which things; -1 for none."""


@dataclass(frozen=True, eq=False)
class Plan:
    """What a scene is made of, before it is compiled.

    Attributes:
        draws: of all things; those that something is done with come first.
        things: the same, drawn.
        parts: what is done.
    """

    draws: tuple[Draw, ...]
    things: tuple[Thing, ...]
    parts: tuple[Part, ...]

    @property
    def acting(self) -> int:
        """The number of things that something is done with."""
        return 1 + max(number for part in self.parts for number in part[1:])


class _Cast:
    """Draws things and remembers how, so that they can be drawn again in another shape or colour."""

    def __init__(self, families: Mapping[str, Family], rng: np.random.Generator):
        self.families, self.rng = families, rng
        self.things: list[Thing] = []
        self.draws: list[Draw] = []

    def add(self, name: str | None = None, shape: int | None = None, color: int | None = None) -> int:
        """Add one of a family; what is not given is random. Returns its number."""
        name = str(self.rng.choice(list(self.families))) if name is None else name
        drawn = self.rng.integers(2**32, size=2).tolist()
        draw = Draw(name, drawn[0] if shape is None else shape, drawn[1] if color is None else color)
        self.things.append(draw.thing(self.families))
        self.draws.append(draw)
        return len(self.things) - 1

    def where(self, wanted: str) -> int:
        """Add a random thing that has some of the attribute `wanted`."""
        for _ in range(200):
            number = self.add()
            offered = getattr(self.things[number], wanted)
            if offered is not None and len(offered):
                return number
            self.things.pop()
            self.draws.pop()
        raise Unreachable(f"no family has {wanted}")

    def distract(self, number: int) -> None:
        """Add things that resemble one."""
        name, shape, color, _ = self.draws[number]
        if self.rng.random() < 0.4:
            self.add(name, shape=shape)
        if self.rng.random() < 0.25:
            self.add(None if self.rng.random() < 0.5 else name, color=color)
        if self.rng.random() < 0.2:
            self.add(name, shape, color)


def draw_plan(
    families: Mapping[str, Family], rng: np.random.Generator, parts_odds: tuple[float, ...] = (0.65, 0.35)
) -> Plan:
    """Things, and one thing to do, or two, or as many as `parts_odds` has chances for.

    Raises:
        Unreachable: if no family can play a part that was drawn.
    """
    cast = _Cast(families, rng)
    parts: list[Part] = []
    for _ in range(int(rng.choice(1 + np.arange(len(parts_odds)), p=parts_odds))):
        kind = str(rng.choice(("carry", "use", "operate", "press", "push"), p=(0.45, 0.12, 0.27, 0.06, 0.1)))
        if kind == "carry":
            below = cast.where("spots") if rng.random() < 0.15 else -1
            parts.append((kind, cast.where("holds"), cast.where("spots"), below))
        elif kind == "use":
            parts.append((kind, cast.where("tool"), cast.add(), -1))
        elif kind == "operate":
            parts.append((kind, cast.where("moving"), -1, -1))
        else:
            parts.append((kind, cast.where("holds"), -1, -1))
    acting = len(cast.things)
    for number in range(acting):
        cast.distract(number)
    for _ in range(int(rng.integers(1, 4))):
        cast.add()
    for items in (cast.things, cast.draws):
        del items[max(MOST_THINGS, acting) :]
    return Plan(tuple(cast.draws), tuple(cast.things), tuple(parts))
