"""A part of a thing in a colour that tells it from others of its kind, whatever colours the rest has."""

from functools import lru_cache

import numpy as np

from imop.sim.parts.shapes import rgba
from imop.training.synthetic.families.thing import Family, Thing, paint

LEAST = 0.08
"""A part that tells has at least this share of the thing's surface, and so has the rest."""


def mark(thing: Thing, geoms: tuple[int, ...], seed: int) -> None:
    """Paint some geoms of a thing, in place, in the colour that is drawn from `seed`."""
    color = rgba(paint(np.random.default_rng(seed)))
    every = thing.part.geoms
    for number in geoms:
        every[number].rgba = color


@lru_cache(maxsize=1000)
def telling(family: Family, shape: int) -> tuple[int, ...]:
    """Numbers of the geoms of one colour that may tell a thing of this shape; none if it has one colour only.

    Things of the same structure in other sizes have the same numbers.

    Args:
        family: draws the thing.
        shape: seed of the shape; it decides which of several parts it is, too.
    """
    part = family(np.random.default_rng(shape), np.random.default_rng(0)).part
    model = part.compile()
    half = model.geom_aabb[:, 3:]
    area = (half * np.roll(half, 1, axis=1)).sum(axis=1)
    which = np.unique(np.array([geom.rgba for geom in part.geoms]), axis=0, return_inverse=True)[1].ravel()
    shares = np.bincount(which, weights=area) / area.sum()
    able = np.flatnonzero((shares > LEAST) & (shares < 1 - LEAST))
    if not len(able):
        return ()
    chosen = np.random.default_rng(shape).choice(able)
    return tuple(np.flatnonzero(which == chosen).tolist())
