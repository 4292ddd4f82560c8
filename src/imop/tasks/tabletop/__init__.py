"""The embedded suite: procedural tasks on a table.

Networks train on the base tasks and are tested on the novel ones, which share no kind of object with them.
"""

from imop.tasks.tabletop.book_in_shelf import BookInShelf
from imop.tasks.tabletop.chains import (
    ButtonsCubes,
    ButtonsJarCup,
    ItemButtons,
    JarCup,
    RingButtonsJar,
    RingCupCubes,
    RubbishLaptopPot,
    RubbishPot,
)
from imop.tasks.tabletop.close_jar import CloseJar
from imop.tasks.tabletop.close_laptop import CloseLaptop
from imop.tasks.tabletop.cup_on_hook import CupOnHook
from imop.tasks.tabletop.grocery_in_cupboard import GroceryInCupboard
from imop.tasks.tabletop.item_in_drawer import ItemInDrawer
from imop.tasks.tabletop.item_in_shelf import ItemInShelf
from imop.tasks.tabletop.lid_off_pot import LidOffPot
from imop.tasks.tabletop.open_bottle import OpenBottle
from imop.tasks.tabletop.open_box import OpenBox
from imop.tasks.tabletop.open_drawer import OpenDrawer
from imop.tasks.tabletop.pour_cup import PourCup
from imop.tasks.tabletop.press_buttons import PressButtons
from imop.tasks.tabletop.ring_on_peg import RingOnPeg
from imop.tasks.tabletop.rubbish_in_bin import RubbishInBin
from imop.tasks.tabletop.stack_blocks import StackBlocks
from imop.tasks.tabletop.stack_cubes import StackCubes
from imop.tasks.tabletop.straighten_rope import StraightenRope
from imop.tasks.tabletop.toys_in_bowl import ToysInBowl
from imop.tasks.tabletop.turn_faucet import TurnFaucet
from imop.tasks.task import Task

BASE: dict[str, type[Task]] = {
    "tabletop/open_drawer": OpenDrawer,
    "tabletop/stack_cubes": StackCubes,
    "tabletop/ring_on_peg": RingOnPeg,
    "tabletop/press_buttons": PressButtons,
    "tabletop/close_jar": CloseJar,
    "tabletop/cup_on_hook": CupOnHook,
    "tabletop/item_in_drawer": ItemInDrawer,
}

NOVEL: dict[str, type[Task]] = {
    "tabletop/lid_off_pot": LidOffPot,
    "tabletop/rubbish_in_bin": RubbishInBin,
    "tabletop/close_laptop": CloseLaptop,
    "tabletop/turn_faucet": TurnFaucet,
    "tabletop/book_in_shelf": BookInShelf,
    "tabletop/open_box": OpenBox,
    "tabletop/straighten_rope": StraightenRope,
}

CROSS_OBJECT: dict[str, type[Task]] = {
    "tabletop/grocery_in_cupboard": GroceryInCupboard,
}
"""Demonstrated with one object, tried with another."""

REAL: dict[str, type[Task]] = {
    "tabletop/toys_in_bowl": ToysInBowl,
    "tabletop/stack_blocks": StackBlocks,
    "tabletop/item_in_shelf": ItemInShelf,
    "tabletop/open_bottle": OpenBottle,
    "tabletop/pour_cup": PourCup,
}
"""After the tasks of the paper's experiment with a real robot; tried with other objects than were shown."""

TABLETOP: dict[str, type[Task]] = {**BASE, **NOVEL, **CROSS_OBJECT, **REAL}

CHAIN: dict[str, type[Task]] = {
    "tabletop/chain_buttons_cubes": ButtonsCubes,
    "tabletop/chain_item_buttons": ItemButtons,
    "tabletop/chain_jar_cup": JarCup,
    "tabletop/chain_buttons_jar_cup": ButtonsJarCup,
    "tabletop/chain_ring_buttons_jar": RingButtonsJar,
    "tabletop/chain_ring_cup_cubes": RingCupCubes,
}
"""Two or three of the base tasks in one scene."""

CHAIN_NOVEL: dict[str, type[Task]] = {
    "tabletop/chain_rubbish_pot": RubbishPot,
    "tabletop/chain_rubbish_laptop_pot": RubbishLaptopPot,
}
"""Two or three of the novel tasks in one scene."""
