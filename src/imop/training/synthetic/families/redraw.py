"""Another thing of the same kind: the decisions of a family are kept, the sizes are drawn anew.

A family decides (`integers`, `choice`, `random`, ...) what its thing is made of, and draws sizes. Sizes and
proportions are positive. A range that holds zero or less is of an angle, or of a place along something; what
was drawn from it stays.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, cast

import mujoco
import numpy as np

from imop.errors import ImopError
from imop.geometry import se3
from imop.training.synthetic.families.thing import Family, Moving, Thing
from imop.types import FloatArray

_TRIES = 20
_TURNED = np.radians(10)
"""Things of one structure have their frames and axes turned by less than this."""
_OTHER = 0.004
"""Metres by which another thing is another."""
_Draw = tuple[str, tuple[Any, ...], Any]
"""Method, arguments, value."""


class Diverged(ImopError):
    """With other sizes the family decides otherwise: the thing has another structure."""


def redrawn(family: Family, shape: int, color: int, sizes: int) -> Thing:
    """A thing of the structure that the family draws from `shape`, in other sizes; colours from `color`.

    Args:
        family: draws the thing.
        shape: seed of the first thing.
        color: seed of the colours of both.
        sizes: seed of the new sizes.

    Raises:
        Diverged: if no thing with the same structure was found.
    """
    recorder = _Recorder(shape)
    first = family(cast(np.random.Generator, recorder), np.random.default_rng(color))
    for number, seed in enumerate(np.random.SeedSequence(sizes).generate_state(_TRIES).tolist()):
        # A family that draws until its thing is sound repeats what failed only with the sizes that failed.
        kept = number * len(recorder.draws) // _TRIES
        replay = _Replay(recorder.draws, kept, seed)
        try:
            other = family(cast(np.random.Generator, replay), np.random.default_rng(color))
        except Diverged:
            continue
        if replay.finished and alike(first, other) and differ(first, other):
            return replace(other, moving=_as_far(first, other))
    raise Diverged(f"no other thing of the same structure in {_TRIES} tries")


class _Recorder:
    """Draws as numpy's default generator does and remembers every draw."""

    def __init__(self, seed: int):
        self._rng = np.random.default_rng(seed)
        self.draws: list[_Draw] = []

    def __getattr__(self, method: str) -> Callable[..., Any]:
        def draw(*args: Any, **options: Any) -> Any:
            value = getattr(self._rng, method)(*args, **options)
            self.draws.append((method, args, value))
            return value

        return draw


class _Replay:
    """Gives recorded draws again, but draws sizes anew after the first `kept` draws."""

    def __init__(self, draws: list[_Draw], kept: int, seed: int):
        self._draws, self._kept, self._next = draws, kept, 0
        self._rng = np.random.default_rng(seed)

    @property
    def finished(self) -> bool:
        """Whether every recorded draw was asked for."""
        return self._next == len(self._draws)

    def __getattr__(self, method: str) -> Callable[..., Any]:
        def draw(*args: Any, **options: Any) -> Any:
            if self.finished:
                raise Diverged("more is drawn than before")
            known, before, value = self._draws[self._next]
            self._next += 1
            if known != method or (method != "uniform" and repr(before) != repr(args)):
                raise Diverged(f"{method} is drawn where {known} was")
            if method != "uniform":
                return value
            if np.min(args[0]) > 0 and self._next > self._kept:
                return self._rng.uniform(*args, **options)
            if args == before:
                return value
            low, high = before[:2]
            return args[0] + (value - low) / (high - low) * (args[1] - args[0])

        return draw


def alike(one: Thing, other: Thing) -> bool:
    """Whether two things have the same structure: equal parts on equal joints, held from the same sides."""
    if _outline(one) != _outline(other):
        return False
    pairs = zip((*_frames(one), *one.rests), (*_frames(other), *other.rests), strict=True)
    turned = (se3.rotation_distance(se3.make(a), se3.make(b)) for a, b in pairs)
    axes = np.sum(one.part.compile().jnt_axis * other.part.compile().jnt_axis, axis=1)
    return all(angle < _TURNED for angle in turned) and bool((axes > np.cos(_TURNED)).all())


def differ(one: Thing, other: Thing) -> bool:
    """Whether something of two things of the same structure is larger or elsewhere, so that one sees it."""
    a, b = one.part.compile(), other.part.compile()
    larger, elsewhere = np.abs(a.geom_size - b.geom_size).max(), np.abs(a.geom_pos - b.geom_pos).max()
    return bool(max(larger, elsewhere) > _OTHER)


def _outline(thing: Thing) -> tuple[object, ...]:
    """What has to be equal."""
    model = thing.part.compile()
    return (
        tuple(hold.link for hold in (*thing.holds, *thing.pokes)),
        tuple((m.joint, m.hold.link, m.push, m.positions[0] < m.positions[1]) for m in thing.moving),
        (len(thing.holds), len(thing.spots), len(thing.rests), thing.symmetry.shape, thing.bends),
        (thing.mount is None, thing.tool is None, thing.row, thing.sided),
        (len(thing.keeps), len(thing.floors), len(thing.goals), len(thing.holes)),
        (model.geom_type.tolist(), model.geom_bodyid.tolist(), model.jnt_type.tolist()),
    )


def _frames(thing: Thing) -> list[FloatArray]:
    """(3, 3) rotations of everything that an action is fixed to."""
    holds = (*thing.holds, *thing.pokes, *(moving.hold for moving in thing.moving))
    others = [T for T in (thing.mount, thing.tool) if T is not None]
    places = (*thing.spots, *thing.keeps, *thing.goals, *thing.holes)
    return [T[:3, :3] for T in (*(hold.T_link_gripper for hold in holds), *places, *others)]


def _as_far(first: Thing, other: Thing) -> tuple[Moving, ...]:
    """The other thing's joints, moved as far as those of the first; what slides, only as far as it can."""
    model, found = other.part.compile(), []
    for a, b in zip(first.moving, other.moving, strict=True):
        positions = a.positions
        if model.joint(b.joint).type[0] == mujoco.mjtJoint.mjJNT_SLIDE:
            start, end = np.clip(positions, min(b.positions), max(b.positions)).tolist()
            positions = (start, end) if start != end else b.positions
        found.append(replace(b, positions=positions))
    return tuple(found)
