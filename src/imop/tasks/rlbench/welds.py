"""Things that hold each other until a task lets them go, and grasps as stiff as RLBench's."""

from typing import Any

import mujoco

from imop.sim.world import CONTACT_SOLREF, GRASP, World

_STIFF = (0.995, 0.9995, 0.001)


def weld_to(spec: Any, name: str, holder: str, body: str) -> None:
    """Let `holder` carry `body` as they stand in the file, until `release`."""
    weld = spec.add_equality(name=name, type=mujoco.mjtEq.mjEQ_WELD)
    weld.objtype = mujoco.mjtObj.mjOBJ_BODY
    weld.name1, weld.name2 = holder, body
    weld.solref = CONTACT_SOLREF


def release(world: World, name: str) -> None:
    """Let go what the weld `name` holds; nothing happens if that was done."""
    world.data.eq_active[world.model.equality(name).id] = 0


def stiffen_grasps(world: World) -> None:
    """Let fingers that squeeze a thing not shift it against the hand."""
    for body in world.graspable:
        world.model.eq_solimp[world.model.equality(f"{GRASP}{body}").id, :3] = _STIFF
