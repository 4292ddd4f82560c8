"""Things that hold each other until a task lets them go."""

from typing import Any

import mujoco

from imop.sim.world import CONTACT_SOLREF, World


def weld_to(spec: Any, name: str, holder: str, body: str) -> None:
    """Let `holder` carry `body` as they stand in the file, until `release`."""
    weld = spec.add_equality(name=name, type=mujoco.mjtEq.mjEQ_WELD)
    weld.objtype = mujoco.mjtObj.mjOBJ_BODY
    weld.name1, weld.name2 = holder, body
    weld.solref = CONTACT_SOLREF


def release(world: World, name: str) -> None:
    """Let go what the weld `name` holds; nothing happens if that was done."""
    world.data.eq_active[world.model.equality(name).id] = 0
