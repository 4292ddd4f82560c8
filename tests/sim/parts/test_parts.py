"""What holds for every part: sensible mass, rest on the table, no penetration."""

import numpy as np
import pytest

from imop.geometry import se3
from imop.sim.parts.bin import waste_bin
from imop.sim.parts.paper import crumpled_paper, height
from imop.sim.parts.pot import PotShape, lid, pot
from imop.sim.parts.shapes import add_to
from imop.sim.parts.solids import SHAPES, block, trinket
from imop.sim.world import TABLE_HEIGHT, World, scene_spec
from imop.tasks.checks import overlaps

RED = (1.0, 0.0, 0.0)
POT = PotShape(radius=0.09, height=0.09, dome=0.015, knob_radius=0.018, knob_height=0.03)

# part, height of its origin above the table, bounds of its mass in kilograms
PARTS = {
    "pot": (lambda: pot(POT, RED, RED), 0.0, (0.2, 2.0)),
    "bin": (lambda: waste_bin(0.07, 0.09, 0.14, RED, RED), 0.14, (0.05, 0.5)),
    "block": (lambda: block((0.045, 0.045, 0.045), RED), 0.045, (0.02, 0.1)),
    **{
        f"paper{seed}": (
            lambda seed=seed: crumpled_paper(0.03, np.random.default_rng(seed), RED),
            height(0.03),
            (0.003, 0.05),
        )
        for seed in range(6)
    },
    **{shape: (lambda shape=shape: trinket(shape, 0.03, 0.07, RED), 0.0, (0.01, 0.2)) for shape in SHAPES},
}


def on_the_table(parts):
    """World with parts {name: (part, T_world_body)}."""
    spec = scene_spec()
    for name, (part, _) in parts.items():
        add_to(spec, name, part)
    world = World(spec)
    for name, (_, T) in parts.items():
        world.set_free_pose(f"{name}/body", T)
    return world


@pytest.mark.parametrize("name", PARTS)
def test_a_part_put_on_the_table_stays_where_it_is(name):
    make, origin, (least, most) = PARTS[name]
    T = se3.make(se3.euler(z=0.7), (0.3, 0.1, TABLE_HEIGHT + origin))
    world = on_the_table({name: (make(), T)})
    assert least < world.model.body(f"{name}/body").mass[0] < most
    world.step(500)
    after = world.pose(f"{name}/body")
    assert se3.translation_distance(T, after) < 0.002
    assert se3.rotation_distance(T, after) < 0.02
    assert overlaps(world) is None
    assert world.data.ncon > 0


def test_the_lid_lies_on_the_pot_and_cannot_slide_off():
    T_pot = se3.make(p=(0.3, 0, TABLE_HEIGHT))
    T_lid = T_pot @ se3.make(p=(0, 0, POT.height + POT.knob_above_rim))
    world = on_the_table({"pot": (pot(POT, RED, RED), T_pot), "lid": (lid(POT, RED, RED), T_lid)})
    assert overlaps(world) is None
    world.step(500)
    assert se3.translation_distance(T_lid, world.pose("lid/body")) < 0.002
    dof = world.model.joint("lid/free").dofadr[0]
    world.data.qvel[dof] = 0.3
    world.step(500)
    assert se3.translation_distance(T_lid, world.pose("lid/body")) < 0.015


def test_a_small_thing_falls_into_the_bin_and_stays_in():
    T_bin = se3.make(p=(0.3, 0, TABLE_HEIGHT + 0.14))
    paper = crumpled_paper(0.03, np.random.default_rng(0), RED)
    parts = {
        "bin": (waste_bin(0.07, 0.09, 0.14, RED, RED), T_bin),
        "paper": (paper, T_bin @ se3.make(p=(0.03, 0, 0.1))),
    }
    world = on_the_table(parts)
    world.step(700)
    x, y, z = (se3.invert(world.pose("bin/body")) @ world.pose("paper/body"))[:3, 3]
    assert np.hypot(x, y) < 0.08
    assert -0.14 < z < -0.05
    assert se3.translation_distance(T_bin, world.pose("bin/body")) < 0.01


def test_papers_of_different_seeds_differ():
    meshes = [
        crumpled_paper(0.03, np.random.default_rng(seed), RED).compile().mesh_vert for seed in (0, 0, 1)
    ]
    assert np.array_equal(meshes[0], meshes[1])
    assert np.abs(meshes[0] - meshes[2]).max() > 0.002
