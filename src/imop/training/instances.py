"""The same things to do with other things of the same kind: other colours, another shape, or both."""

from collections.abc import Mapping, Sequence
from typing import Literal, get_args

import numpy as np

from imop.errors import InvalidInput
from imop.training.families.marked import telling
from imop.training.families.redraw import Diverged
from imop.training.families.thing import Family
from imop.training.plans import Draw, Plan
from imop.training.stage import Unreachable

Variation = Literal["same", "color", "shape", "both"]
"""What differs between the things shown and those in the query."""
VARIATIONS: tuple[Variation, ...] = get_args(Variation)
_CHANGED = 0.6
"""How often each of several things is another one; one is always."""
_TOLD = 0.5
"""How often a thing whose colours change is told from others of its kind by a part that keeps its own."""
_ALIKE = 0.5
"""How often things of the same shape that are told by their colours all change it."""


def shares(mix: Sequence[float]) -> dict[Variation, float]:
    """How often each variation is wanted, of sum 1.

    Raises:
        InvalidInput: if there is not one number for each, none negative and one positive.
    """
    if len(mix) != len(VARIATIONS) or min(mix) < 0 or not 0 < sum(mix) < np.inf:
        accepted = f"{len(VARIATIONS)} numbers from 0 up, one of them positive: " + ", ".join(VARIATIONS)
        raise InvalidInput("mix", f"{tuple(mix)}", accepted)
    return {variation: share / sum(mix) for variation, share in zip(VARIATIONS, mix, strict=True)}


def other_instances(
    plan: Plan, families: Mapping[str, Family], variation: Variation, rng: np.random.Generator
) -> tuple[Plan, Plan, frozenset[int]]:
    """The plan and the same one with other things, and which of the things something is done with are others.

    Nobody could say which is meant among things of one kind that all look otherwise than before. So they are
    left out of both plans, or told by colour: by that of the whole thing, if it stays, or by that of one part
    while everything else about all of them changes.

    Raises:
        Unreachable: if nothing can be another: all act beside one of their kind, or have no other shape.
    """
    acting = [draw.family for draw in plan.draws[: plan.acting]]
    alone = [i for i, family in enumerate(acting) if acting.count(family) == 1]
    if not alone:
        raise Unreachable("things of one kind act together")
    changed = {i for i in alone if rng.random() < _CHANGED} or {int(rng.choice(alone))}
    shown, asked = list(plan.draws), list(plan.draws)
    kept = set(range(len(shown)))
    for i in sorted(changed):
        _change(i, plan, families, variation, rng, shown, asked, kept)
    order = sorted(kept)
    try:
        # A thing can be in one scene only, so those of the second are always drawn anew.
        before, after = (_drawn(plan, [draws[i] for i in order], families) for draws in (shown, asked))
    except Diverged as error:
        raise Unreachable("a thing has no other shape") from error
    return before, after, frozenset(changed)


def _change(
    i: int,
    plan: Plan,
    families: Mapping[str, Family],
    variation: Variation,
    rng: np.random.Generator,
    shown: list[Draw],
    asked: list[Draw],
    kept: set[int],
) -> None:
    """Make thing `i` another one in what is `asked`, and decide what becomes of those of its kind."""
    draw = plan.draws[i]
    color, sizes, mark = rng.integers(2**32, size=3).tolist()

    def other(one: Draw) -> Draw:
        one = one if variation == "shape" else one._replace(color=color)
        return one if variation == "color" else one._replace(sizes=sizes)

    around = range(plan.acting, len(shown))
    equal = [i, *(k for k in around if plan.draws[k] == draw)]
    rivals = [k for k in around if plan.draws[k].family == draw.family and k not in equal]
    told = variation != "shape" and rng.random() < _TOLD and telling(families[draw.family], draw.shape)
    if told:
        rivals = rivals or [k for k in around if k not in equal][: int(rng.integers(1, 4))]
    marks = rng.integers(2**32, size=len(rivals)).tolist()
    for k in equal:
        shown[k] = draw._replace(mark=mark) if told else draw
        asked[k] = other(shown[k])
    alike = rng.random() < _ALIKE
    for k, own in zip(rivals, marks, strict=True):
        if told:
            shown[k] = draw._replace(mark=own)
            asked[k] = other(shown[k])
        elif variation != "shape" or shown[k].color == draw.color:
            kept.discard(k)
        elif alike and shown[k].shape == draw.shape:
            asked[k] = other(shown[k])


def _drawn(plan: Plan, draws: Sequence[Draw], families: Mapping[str, Family]) -> Plan:
    return Plan(tuple(draws), tuple(draw.thing(families) for draw in draws), plan.parts)
