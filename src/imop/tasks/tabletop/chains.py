"""Chains of two and three tasks of the suite."""

from imop.tasks.tabletop.chain import Chain
from imop.tasks.tabletop.close_jar import CloseJar
from imop.tasks.tabletop.close_laptop import CloseLaptop
from imop.tasks.tabletop.cup_on_hook import CupOnHook
from imop.tasks.tabletop.item_in_drawer import ItemInDrawer
from imop.tasks.tabletop.lid_off_pot import LidOffPot
from imop.tasks.tabletop.press_buttons import PressButtons
from imop.tasks.tabletop.ring_on_peg import RingOnPeg
from imop.tasks.tabletop.rubbish_in_bin import RubbishInBin
from imop.tasks.tabletop.stack_cubes import StackCubes


class ButtonsCubes(Chain):
    """Press buttons, then stack cubes."""

    name = "tabletop/chain_buttons_cubes"
    parts = (PressButtons, StackCubes)


class ItemButtons(Chain):
    """Put an item into a drawer, then press buttons."""

    name = "tabletop/chain_item_buttons"
    parts = (ItemInDrawer, PressButtons)


class JarCup(Chain):
    """Close a jar, then hang up a cup."""

    name = "tabletop/chain_jar_cup"
    parts = (CloseJar, CupOnHook)


class ButtonsJarCup(Chain):
    """Press buttons, close a jar, hang up a cup."""

    name = "tabletop/chain_buttons_jar_cup"
    parts = (PressButtons, CloseJar, CupOnHook)


class RingCupCubes(Chain):
    """Put a ring on a peg, hang up a cup, stack cubes."""

    name = "tabletop/chain_ring_cup_cubes"
    parts = (RingOnPeg, CupOnHook, StackCubes)


class RingButtonsJar(Chain):
    """Put a ring on a peg, press buttons, close a jar."""

    name = "tabletop/chain_ring_buttons_jar"
    parts = (RingOnPeg, PressButtons, CloseJar)


class RubbishPot(Chain):
    """Throw paper away, then lift a lid."""

    name = "tabletop/chain_rubbish_pot"
    parts = (RubbishInBin, LidOffPot)


class RubbishLaptopPot(Chain):
    """Throw paper away, close a laptop, lift a lid."""

    name = "tabletop/chain_rubbish_laptop_pot"
    parts = (RubbishInBin, CloseLaptop, LidOffPot)
