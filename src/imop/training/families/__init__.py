"""Families of procedural things. The novel tasks' kinds of things are apart, for testing only."""

from imop.training.families import cabinets, rings, solids, tools, vessels
from imop.training.families.held_out import HELD_OUT
from imop.training.families.thing import Family, Thing

TRAINING: dict[str, Family] = {
    "block": solids.block,
    "tray": solids.tray,
    "rack": solids.rack,
    "target": solids.target,
    "letter": solids.letter,
    "can": vessels.can,
    "bottle": vessels.bottle,
    "mug": vessels.mug,
    "bowl": vessels.bowl,
    "plate": vessels.plate,
    "ring": rings.ring,
    "peg": rings.peg,
    "stand": rings.stand,
    "turned": rings.stacker,
    "knife": tools.knife,
    "hammer": tools.hammer,
    "broom": tools.broom,
    "driver": tools.driver,
    "spoon": tools.spoon,
    "drawers": cabinets.drawers,
    "door": cabinets.door,
    "panel": cabinets.panel,
    "lever": cabinets.lever,
    "knob": cabinets.knob,
    "buttons": cabinets.buttons,
    "switch": cabinets.switch,
}
"""What the bundled weights learn from."""

__all__ = ["HELD_OUT", "TRAINING", "Family", "Thing"]
