"""RLBench's tasks of the paper in our own world: scenes from the user's model files, our own logic.

The paper trains on the base tasks and tests from one demonstration on the novel ones.
"""

from imop.tasks.rlbench.basketball_in_hoop import BasketballInHoop
from imop.tasks.rlbench.beat_the_buzz import BeatTheBuzz
from imop.tasks.rlbench.block_pyramid import BlockPyramid
from imop.tasks.rlbench.change_clock import ChangeClock
from imop.tasks.rlbench.close_jar import CloseJar
from imop.tasks.rlbench.close_laptop_lid import CloseLaptopLid
from imop.tasks.rlbench.close_microwave import CloseMicrowave
from imop.tasks.rlbench.hit_ball_with_queue import HitBallWithQueue
from imop.tasks.rlbench.insert_onto_square_peg import InsertOntoSquarePeg
from imop.tasks.rlbench.lamp_on import LampOn
from imop.tasks.rlbench.light_bulb_in import LightBulbIn
from imop.tasks.rlbench.long import PlaceThreeCups, StackFourBlocks
from imop.tasks.rlbench.meat_off_grill import MeatOffGrill
from imop.tasks.rlbench.open_box import OpenBox
from imop.tasks.rlbench.open_door import OpenDoor
from imop.tasks.rlbench.open_drawer import OpenDrawer
from imop.tasks.rlbench.open_wine_bottle import OpenWineBottle
from imop.tasks.rlbench.phone_on_base import PhoneOnBase
from imop.tasks.rlbench.place_cups import PlaceCups
from imop.tasks.rlbench.place_hanger_on_rack import PlaceHangerOnRack
from imop.tasks.rlbench.place_shape_in_shape_sorter import PlaceShapeInShapeSorter
from imop.tasks.rlbench.place_wine_at_rack_location import PlaceWineAtRackLocation
from imop.tasks.rlbench.play_jenga import PlayJenga
from imop.tasks.rlbench.push_buttons import PushButtons
from imop.tasks.rlbench.put_groceries_in_cupboard import PutGroceriesInCupboard
from imop.tasks.rlbench.put_item_in_drawer import PutItemInDrawer
from imop.tasks.rlbench.put_knife_on_chopping_board import PutKnifeOnChoppingBoard
from imop.tasks.rlbench.put_money_in_safe import PutMoneyInSafe
from imop.tasks.rlbench.put_rubbish_in_bin import PutRubbishInBin
from imop.tasks.rlbench.reach_and_drag import ReachAndDrag
from imop.tasks.rlbench.remove_cups import RemoveCups
from imop.tasks.rlbench.scoop_with_spatula import ScoopWithSpatula
from imop.tasks.rlbench.slide_block_to_color_target import SlideBlockToColorTarget
from imop.tasks.rlbench.slide_cabinet_open_and_place_cups import SlideCabinetOpenAndPlaceCups
from imop.tasks.rlbench.stack_blocks import StackBlocks
from imop.tasks.rlbench.stack_cups import StackCups
from imop.tasks.rlbench.straighten_rope import StraightenRope
from imop.tasks.rlbench.sweep_to_dustpan_of_size import SweepToDustpanOfSize
from imop.tasks.rlbench.take_lid_off_saucepan import TakeLidOffSaucepan
from imop.tasks.rlbench.take_money_out_safe import TakeMoneyOutSafe
from imop.tasks.rlbench.turn_tap import TurnTap
from imop.tasks.task import Task

BASE: dict[str, type[Task]] = {
    "rlbench/put_item_in_drawer": PutItemInDrawer,
    "rlbench/reach_and_drag": ReachAndDrag,
    "rlbench/turn_tap": TurnTap,
    "rlbench/slide_block_to_color_target": SlideBlockToColorTarget,
    "rlbench/open_drawer": OpenDrawer,
    "rlbench/put_groceries_in_cupboard": PutGroceriesInCupboard,
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
    "rlbench/meat_off_grill": MeatOffGrill,
    "rlbench/stack_cups": StackCups,
}

NOVEL: dict[str, type[Task]] = {
    "rlbench/basketball_in_hoop": BasketballInHoop,
    "rlbench/put_rubbish_in_bin": PutRubbishInBin,
    "rlbench/scoop_with_spatula": ScoopWithSpatula,
    "rlbench/place_hanger_on_rack": PlaceHangerOnRack,
    "rlbench/hit_ball_with_queue": HitBallWithQueue,
    "rlbench/block_pyramid": BlockPyramid,
    "rlbench/take_lid_off_saucepan": TakeLidOffSaucepan,
    "rlbench/lamp_on": LampOn,
    "rlbench/phone_on_base": PhoneOnBase,
    "rlbench/open_box": OpenBox,
    "rlbench/close_laptop_lid": CloseLaptopLid,
    "rlbench/beat_the_buzz": BeatTheBuzz,
    "rlbench/remove_cups": RemoveCups,
    "rlbench/play_jenga": PlayJenga,
    "rlbench/put_knife_on_chopping_board": PutKnifeOnChoppingBoard,
    "rlbench/straighten_rope": StraightenRope,
    "rlbench/change_clock": ChangeClock,
    "rlbench/open_wine_bottle": OpenWineBottle,
    "rlbench/open_door": OpenDoor,
    "rlbench/take_money_out_safe": TakeMoneyOutSafe,
    "rlbench/close_microwave": CloseMicrowave,
    "rlbench/slide_cabinet_open_and_place_cups": SlideCabinetOpenAndPlaceCups,
}

RLBENCH: dict[str, type[Task]] = {**BASE, **NOVEL}

LONG: dict[str, type[Task]] = {
    "rlbench/block_pyramid": BlockPyramid,
    "rlbench/stack_four_blocks": StackFourBlocks,
    "rlbench/stack_cups": StackCups,
    "rlbench/place_three_cups": PlaceThreeCups,
}
"""Tasks and variations of more than one thing; apart from the others, so that no scene counts twice."""
