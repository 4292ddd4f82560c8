"""Numbers that the paper prints, under our names of the tasks.

`tests/reproduce/test_published.py` compares every one of them with the paper's text.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace


@dataclass(frozen=True)
class Published:
    """One row of a table of the paper.

    Attributes:
        label: of the method or configuration.
        average: mean success over all tasks, percent; None where the paper has none.
        rank: mean rank over all tasks.
        tasks: success in percent, by our name of the task without the suite.
        parameters: how many the networks have, in millions.
    """

    label: str
    average: float | None = None
    rank: float | None = None
    tasks: Mapping[str, float] = field(default_factory=dict)
    parameters: float | None = None


BASE_TASKS = {
    "Close Jar": "close_jar",
    "Drag Stick": "reach_and_drag",
    "Insert Peg": "insert_onto_square_peg",
    "Meat off Grill": "meat_off_grill",
    "Open Drawer": "open_drawer",
    "Place Cups": "place_cups",
    "Place Wine": "place_wine_at_rack_location",
    "Push Buttons": "push_buttons",
    "Put in Cupboard": "put_groceries_in_cupboard",
    "Put in Drawer": "put_item_in_drawer",
    "Put in Safe": "put_money_in_safe",
    "Screw Bulb": "light_bulb_in",
    "Slide Block": "slide_block_to_color_target",
    "Sort Shape": "place_shape_in_shape_sorter",
    "Stack Blocks": "stack_blocks",
    "Stack Cups": "stack_cups",
    "Sweep to Dustpan": "sweep_to_dustpan_of_size",
    "Turn Tap": "turn_tap",
}
"""Columns of the paper's table of base tasks, in its order -> our names."""

NOVEL_TASKS = {
    "Ball in Hoop": "basketball_in_hoop",
    "Rubbish in Bin": "put_rubbish_in_bin",
    "Scoop Spatula": "scoop_with_spatula",
    "Place Hanger": "place_hanger_on_rack",
    "Hit Ball": "hit_ball_with_queue",
    "Block Pyramid": "block_pyramid",
    "Slide Place": "slide_cabinet_open_and_place_cups",
    "Phone on Base": "phone_on_base",
    "Open Box": "open_box",
    "Close Lid": "close_laptop_lid",
    "Lid off Pan": "take_lid_off_saucepan",
    "Lamp On": "lamp_on",
    "Beat Buzz": "beat_the_buzz",
    "Remove Cups": "remove_cups",
    "Play Jenga": "play_jenga",
    "Knife on Board": "put_knife_on_chopping_board",
    "Straighten Rope": "straighten_rope",
    "Change Clock": "change_clock",
    "Open Bottle": "open_wine_bottle",
    "Open Door": "open_door",
    "Money out Safe": "take_money_out_safe",
    "Close Microwave": "close_microwave",
}
"""Columns of the paper's table of novel tasks, in its order -> our names."""

REAL_TASKS = {
    "Put toys in bowl": "toys_in_bowl",
    "Stack blocks": "stack_blocks",
    "Put item in shelf": "item_in_shelf",
    "Open bottle": "open_bottle",
    "Pour cup": "pour_cup",
}
"""Rows of the paper's table of real-robot trials, in its order -> our names."""


def _row(label: str, average: float, rank: float, names: Mapping[str, str], *rates: float) -> Published:
    return Published(label, average, rank, dict(zip(names.values(), rates, strict=True)))


# fmt: off
BASE = (
    _row("C2F-ARM", 20.1, 4.9, BASE_TASKS,
         24, 24, 4, 20, 20, 0, 8, 72,
         0, 4, 12, 8, 16, 8, 0, 0, 0, 68),
    _row("PerAct", 49.4, 3.6, BASE_TASKS,
         55.2, 89.6, 5.6, 70.4, 88, 2.4, 44.8, 92.8,
         28, 51.2, 84, 17.6, 74, 16.8, 26.4, 2.4, 52, 88),
    _row("RVT", 62.9, 2.3, BASE_TASKS,
         52, 99.2, 11.2, 88, 71.2, 4, 91, 100,
         49.6, 88.0, 91.2, 48, 81.6, 36, 28.8, 26.4, 72, 93.6),
    _row("Act3D", 65.1, 2.2, BASE_TASKS,
         92, 92, 27, 94, 93, 3, 80, 99,
         51, 90, 95, 47, 93, 8, 12, 9, 92, 94),
    _row("IMOP", 69.6, 1.9, BASE_TASKS,
         39.2, 98.4, 12.0, 92.0, 100.0, 52.8, 96.0, 96.0,
         46.4, 100.0, 96.0, 82.0, 58.4, 37.6, 40.0, 56.8, 100.0, 51.2),
)

NOVEL = (
    _row("RVT+FT", 29.8, 2, NOVEL_TASKS,
         42.4, 50, 7.2, 4, 1.6, 0, 0, 20.4, 28, 100,
         78.8, 65.2, 19.2, 4, 40.8, 14, 0, 10.4, 34.4, 68, 22.4, 44),
    _row("RVT+HDT", 26.9, 2.4, NOVEL_TASKS,
         87.6, 40.4, 0, 0, 0, 0, 0, 0, 24.8, 91.2,
         80.4, 72, 16.4, 0, 27.6, 8, 0, 36, 23.2, 12, 12, 59.6),
    _row("IMOP", 41.3, 1.5, NOVEL_TASKS,
         80.0, 94.0, 52.0, 24.4, 32.0, 5.2, 6.8, 22.8, 8.0, 71.2,
         100.0, 12.0, 20.0, 36.0, 100.0, 20.0, 16.8, 24.0, 81.6, 41.2, 42.8, 21.6),
)
# fmt: on

LONG = (
    Published(
        "IMOP",
        tasks={"block_pyramid": NOVEL[-1].tasks["block_pyramid"], "stack_cups": BASE[-1].tasks["stack_cups"]},
    ),
)
"""The paper's own rates of tasks that are long in all of their variations."""

PARAMETERS_BASE = (
    Published("RVT+FT", 4.7, parameters=104),
    Published("RVT+HDT", 62.9, parameters=131),
    Published("IMOP", 69.6, parameters=80.8),
)
PARAMETERS_NOVEL = tuple(
    replace(row, average=average) for row, average in zip(PARAMETERS_BASE, (29.8, 26.9, 41.3), strict=True)
)

ABLATIONS = {
    "IMOP": (69.6, 41.3),
    "without low-dimensional robot states": (63.2, 33.0),
    "traditional attention": (52.8, 16.4),
    "directly matched, without a region": (6.7, None),
    "K = 4": (58.7, 32.4),
    "K = 8": (64.5, 38.6),
    "K = 16": (69.6, 41.3),
    "regression from matched points": (58.2, 29.4),
    "conventional pose regression": (65.1, None),
}
"""Rows of the paper's table of ablations -> success on base and on novel tasks, percent."""

ABLATIONS_BASE = tuple(Published(label, base) for label, (base, _) in ABLATIONS.items())
ABLATIONS_NOVEL = tuple(Published(label, novel) for label, (_, novel) in ABLATIONS.items())

REAL_ROBOT = tuple(
    Published(label, tasks=dict(zip(REAL_TASKS.values(), rates, strict=True)))
    for label, rates in (("One-shot RVT", (30, 10, 20, 20, 20)), ("IMOP", (80, 40, 50, 40, 50)))
)
