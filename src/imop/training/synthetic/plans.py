"""What a random scene is made of: things that something is done with, and things that distract."""

from collections.abc import Callable, Mapping, Sequence, Sized
from dataclasses import dataclass
from functools import cache, partial
from typing import NamedTuple

import numpy as np

from imop.errors import InvalidInput
from imop.extras import extra
from imop.training.synthetic.families.marked import mark, telling
from imop.training.synthetic.families.redraw import redrawn
from imop.training.synthetic.families.thing import Family, Floor, Thing
from imop.training.synthetic.stage import Unreachable
from imop.types import FloatArray

with extra("sim"):
    import mujoco

MOST_THINGS = 8
_PATIENCE = 60
"""So many things are drawn at most to find one that can play a part."""
_PROBES = 4


class Draw(NamedTuple):
    """How a thing was drawn: equal draws are indistinguishable things.

    Attributes:
        family: its name.
        shape, color: seeds.
        sizes: seed of other sizes for that shape, or None.
        mark: seed of the colour of a part that tells it from others of its kind, or None.
    """

    family: str
    shape: int
    color: int
    sizes: int | None = None
    mark: int | None = None

    def thing(self, families: Mapping[str, Family]) -> Thing:
        """Draw it again.

        Raises:
            Diverged: if the shape has no other sizes.
        """
        family = families[self.family]
        if self.sizes is None:
            thing = family(np.random.default_rng(self.shape), np.random.default_rng(self.color))
        else:
            thing = redrawn(family, self.shape, self.color, self.sizes)
        if self.mark is not None:
            mark(thing, telling(family, self.shape), self.mark)
        return thing


Part = tuple[str, *tuple[int, ...]]
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

    def where(self, wanted: str, fits: Callable[[Thing], bool] = lambda thing: True) -> int:
        """Add a random thing that has some of the attribute `wanted`, and fits.

        Raises:
            Unreachable: if none was found.
        """
        able = [name for name, family in self.families.items() if _offers(family, wanted)]
        for _ in range(_PATIENCE if able else 0):
            number = self.add(str(self.rng.choice(able)))
            offered = getattr(self.things[number], wanted)
            if _some(offered) and fits(self.things[number]):
                return number
            self.things.pop()
            self.draws.pop()
        raise Unreachable(f"no family has {wanted}")

    def distract(self, number: int, equal: bool) -> None:
        """Add things that resemble one, some of them `equal` to it."""
        name, shape, color, *_ = self.draws[number]
        if self.rng.random() < 0.4:
            self.add(name, shape=shape)
        if self.rng.random() < 0.25:
            self.add(None if self.rng.random() < 0.5 else name, color=color)
        if self.rng.random() < 0.2 and equal:
            self.add(name, shape, color)


def _offers(family: Family, wanted: str) -> bool:
    """Whether any of a few things of a family has some of an attribute."""
    return any(_some(getattr(thing, wanted)) for thing in _probes(family))


@cache
def _probes(family: Family) -> tuple[Thing, ...]:
    return tuple(family(rng, rng) for rng in map(np.random.default_rng, range(_PROBES)))


def _some(offered: object) -> bool:
    """Whether there is any of what a thing offers: frames, joints, a tool, or a yes."""
    return offered is True or (isinstance(offered, Sized) and len(offered) > 0)


SHARES = {
    "carry": 0.29,
    "use": 0.08,
    "operate": 0.17,
    "press": 0.05,
    "push": 0.06,
    "keep": 0.08,
    "unpack": 0.08,
    "shove": 0.07,
    "sink": 0.04,
    "row": 0.04,
    "side": 0.04,
}
"""What is done, and how often. The last six are kinds of goals: what is held is kept at it; a thing lies
anywhere in another one; it is pushed to something; put into a hole; one of several equal joints is moved; a
thing has one right side."""


def check_kinds(kinds: Sequence[str]) -> None:
    """Refuse what is not done in any plan.

    Raises:
        InvalidInput: if there is no such kind.
    """
    if unknown := sorted(set(kinds) - set(SHARES)):
        raise InvalidInput("kinds", f"no {', '.join(unknown)}", ", ".join(SHARES))


def draw_plan(
    families: Mapping[str, Family],
    rng: np.random.Generator,
    parts_odds: tuple[float, ...] = (0.65, 0.35),
    kinds: Sequence[str] = (),
) -> Plan:
    """Things, and one thing to do, or two, or as many as `parts_odds` has chances for; of some kinds, or all.

    Raises:
        Unreachable: if no family can play a part that was drawn.
    """
    cast = _Cast(families, rng)
    parts: list[Part] = []
    odds = np.array([share if not kinds or kind in kinds else 0.0 for kind, share in SHARES.items()])
    for _ in range(int(rng.choice(1 + np.arange(len(parts_odds)), p=parts_odds))):
        parts.append(_part(cast, str(rng.choice(list(SHARES), p=odds / odds.sum()))))
    acting = len(cast.things)
    # What is beside it tells to which of equal goals something is pushed, but nothing of the goal itself.
    unique = {part[-1] for part in parts if part[0] in ("shove", "row")}
    for number in range(acting):
        cast.distract(number, number not in unique)
    for _ in range(int(rng.integers(1, 4))):
        cast.add()
    for items in (cast.things, cast.draws):
        del items[max(MOST_THINGS, acting) :]
    return Plan(tuple(cast.draws), tuple(cast.things), tuple(parts))


def _part(cast: _Cast, kind: str) -> Part:
    """Draw the things for something to do."""
    rng = cast.rng
    if kind in ("carry", "use", "operate", "press", "push"):
        return _plain(cast, kind)
    if kind == "keep":
        return kind, cast.where("holds"), cast.where("keeps") if rng.random() < 0.6 else cast.add()
    if kind == "unpack":
        below = cast.where("floors")
        floors = cast.things[below].floors
        held = cast.where("holds", partial(_small, floors=floors))
        target = cast.where("spots")
        count = int(rng.integers(3))
        others: tuple[int, ...] = tuple(
            cast.where("holds", partial(_small, floors=floors)) for _ in range(count)
        )
        things: tuple[int, ...] = (held, below, target, *others)
        return (kind, *things)
    if kind == "shove":
        pushed = cast.where("holds", _low)
        goal = cast.where("goals") if rng.random() < 0.7 else cast.where("symmetry", _one_way)
        return kind, pushed, goal
    if kind == "sink":
        board = cast.where("holes")
        return kind, cast.where("holds", _slim), board
    if kind == "row":
        return kind, cast.where("row")
    return _sided(cast)


def _plain(cast: _Cast, kind: str) -> Part:
    if kind == "carry":
        below = cast.where("spots") if cast.rng.random() < 0.15 else -1
        return kind, cast.where("holds"), cast.where("spots"), below
    if kind == "use":
        return kind, cast.where("tool"), cast.add()
    return kind, cast.where("moving" if kind == "operate" else "holds")


def _sided(cast: _Cast) -> Part:
    """What a thing that has sides allows: to move its joint, press on it, carry it or put something to it."""
    number = cast.where("sided")
    thing, rng = cast.things[number], cast.rng
    ways = {"operate": thing.moving, "press": thing.pokes, "carry": thing.holds, "carry to": thing.spots}
    way = str(rng.choice([way for way, offered in ways.items() if offered]))
    if way == "carry":
        return way, number, cast.where("spots")
    if way == "carry to":
        return "carry", cast.where("holds"), number
    return way, number


def _one_way(thing: Thing) -> bool:
    """Whether every turn of it is seen."""
    return len(thing.symmetry) == 1 and not thing.moving and not thing.bends


def _low(thing: Thing) -> bool:
    """Whether it is pushed rather than toppled."""
    x, y, z = _extent(thing)
    return bool(min(x, y) > 0.025 and max(x, y) < 0.16 and z < 2.5 * min(x, y))


def _slim(thing: Thing) -> bool:
    """Whether it goes into a hole."""
    return bool(_extent(thing)[:2].min() < 0.06)


def _small(thing: Thing, floors: Sequence[Floor]) -> bool:
    """Whether it leaves room on each of the floors."""
    across = float(np.hypot(*_extent(thing)[:2]))
    return all(across < 1.6 * min(floor.half) for floor in floors)


def _extent(thing: Thing) -> FloatArray:
    """(3,) metres, of the box around it, joints at 0."""
    model = thing.part.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    turned = np.abs(data.geom_xmat.reshape(-1, 3, 3))
    half = np.einsum("gij,gj->gi", turned, model.geom_aabb[:, 3:])
    middle = data.geom_xpos + np.einsum(
        "gij,gj->gi", data.geom_xmat.reshape(-1, 3, 3), model.geom_aabb[:, :3]
    )
    return np.asarray((middle + half).max(axis=0) - (middle - half).min(axis=0))
