"""Whether a thing has a place for itself: how near other things are."""

from collections.abc import Collection

import mujoco
import numpy as np

from imop.sim.cameras import VISIBLE_GROUPS
from imop.sim.world import World
from imop.types import IntArray

GROUND = ("table", "floor", "wall")
"""What things stand on or before."""


def geoms_of(world: World, bodies: Collection[int]) -> tuple[IntArray, IntArray]:
    """The geometries of some bodies, and all others that are seen or felt but the ground."""
    m = world.model
    own = np.isin(m.geom_bodyid, list(bodies))
    ground = np.isin(m.geom_bodyid, [m.body(b).id for b in GROUND])
    there = (m.geom_contype != 0) | ((VISIBLE_GROUPS[m.geom_group] != 0) & (m.geom_rgba[:, 3] > 0))
    mine, others = np.flatnonzero(own), np.flatnonzero(there & ~own & ~ground)
    return mine.astype(np.int32), others.astype(np.int32)


def is_clear(world: World, own: IntArray, others: IntArray, clearance: float) -> bool:
    """Whether some geometries keep `clearance` (metres) from others."""
    m, d = world.model, world.data
    apart = np.linalg.norm(d.geom_xpos[own][:, None] - d.geom_xpos[others][None], axis=2)
    near = apart < m.geom_rbound[own][:, None] + m.geom_rbound[others][None] + clearance
    return not any(
        mujoco.mj_geomDistance(m, d, int(own[i]), int(others[k]), clearance, None) < clearance
        for i, k in np.argwhere(near)
    )
