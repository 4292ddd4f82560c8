"""RLBench's tasks of the paper in our own world: scenes from the user's model files, our own logic.

The paper trains on the base tasks and tests from one demonstration on the novel ones.
"""

from imop.tasks.rlbench.close_jar import CloseJar
from imop.tasks.rlbench.insert_onto_square_peg import InsertOntoSquarePeg
from imop.tasks.rlbench.light_bulb_in import LightBulbIn
from imop.tasks.rlbench.open_drawer import OpenDrawer
from imop.tasks.rlbench.place_cups import PlaceCups
from imop.tasks.rlbench.place_shape_in_shape_sorter import PlaceShapeInShapeSorter
from imop.tasks.rlbench.place_wine_at_rack_location import PlaceWineAtRackLocation
from imop.tasks.rlbench.push_buttons import PushButtons
from imop.tasks.rlbench.put_item_in_drawer import PutItemInDrawer
from imop.tasks.rlbench.put_money_in_safe import PutMoneyInSafe
from imop.tasks.rlbench.reach_and_drag import ReachAndDrag
from imop.tasks.rlbench.slide_block_to_color_target import SlideBlockToColorTarget
from imop.tasks.rlbench.stack_blocks import StackBlocks
from imop.tasks.rlbench.stack_cups import StackCups
from imop.tasks.rlbench.sweep_to_dustpan_of_size import SweepToDustpanOfSize
from imop.tasks.task import Task

BASE: dict[str, type[Task]] = {
    "rlbench/put_item_in_drawer": PutItemInDrawer,
    "rlbench/reach_and_drag": ReachAndDrag,
    "rlbench/slide_block_to_color_target": SlideBlockToColorTarget,
    "rlbench/open_drawer": OpenDrawer,
    "rlbench/place_shape_in_shape_sorter": PlaceShapeInShapeSorter,
    "rlbench/put_money_in_safe": PutMoneyInSafe,
    "rlbench/push_buttons": PushButtons,
    "rlbench/close_jar": CloseJar,
    "rlbench/stack_blocks": StackBlocks,
    "rlbench/place_cups": PlaceCups,
    "rlbench/place_wine_at_rack_location": PlaceWineAtRackLocation,
    "rlbench/light_bulb_in": LightBulbIn,
    "rlbench/sweep_to_dustpan_of_size": SweepToDustpanOfSize,
    "rlbench/insert_onto_square_peg": InsertOntoSquarePeg,
    "rlbench/stack_cups": StackCups,
}

NOVEL: dict[str, type[Task]] = {}

RLBENCH: dict[str, type[Task]] = {**BASE, **NOVEL}
