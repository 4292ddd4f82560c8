import pytest

from imop.geometry import se3
from imop.sim.parts.bookshelf import BOARD, PLINTH
from imop.sim.world import TABLE_HEIGHT
from imop.tasks.tabletop.book_in_shelf import BookInShelf
from imop.tasks.task import make_scene


@pytest.fixture
def scene():
    task = BookInShelf()
    return task, make_scene(task, 1, 3, 3)


def test_the_other_book_in_the_free_place_is_not_the_aim(scene):
    task, world = scene
    in_place = world.pose("shelf/body") @ se3.make(p=(0.005, 0, task.book.height))
    world.set_free_pose("other/body", in_place)
    assert not task.success(world)


def test_the_book_must_stand_in_the_free_place(scene):
    task, world = scene
    T_world_shelf = world.pose("shelf/body")
    assert T_world_shelf[2, 3] == pytest.approx(TABLE_HEIGHT + BOARD + PLINTH)
    for p, reached in (((0, 0, 0), True), ((0, 0, 0.05), False), ((0, 0.05, 0), False)):
        stands = se3.make(p=(p[0], p[1], task.book.height + p[2]))
        world.set_free_pose("book/body", T_world_shelf @ stands)
        assert task.success(world) == reached
