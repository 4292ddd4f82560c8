import numpy as np
import pytest

from imop.geometry import se3
from imop.sim.parts.bookshelf import BOARD, PLINTH, BookShape, ShelfShape, book, bookshelf
from imop.sim.parts.shapes import add_to
from imop.sim.world import TABLE_HEIGHT, World, scene_spec
from imop.tasks.checks import overlaps

BOOK = BookShape(thickness=0.035, depth=0.12, height=0.17)
LOW = BookShape(thickness=0.03, depth=0.11, height=0.13)
SHELF = ShelfShape(left=(LOW, LOW), right=(LOW,), free=0.045, depth=0.145, height=0.1)
COLOR = (0.5, 0.5, 0.5)
T_WORLD_SHELF = se3.make(se3.euler(z=0.7), (0.3, 0, TABLE_HEIGHT + BOARD + PLINTH))


@pytest.fixture
def world():
    spec = scene_spec()
    add_to(spec, "shelf", bookshelf(SHELF, COLOR, [COLOR] * 3))
    add_to(spec, "book", book(BOOK, COLOR))
    world = World(spec)
    world.set_free_pose("shelf/body", T_WORLD_SHELF)
    return world


def test_a_book_fits_into_the_free_place_and_stays_upright_there(world):
    T = T_WORLD_SHELF @ se3.make(p=(0.005, 0, BOOK.height))
    world.set_free_pose("book/body", T)
    assert overlaps(world) is None
    world.step(500)
    assert se3.translation_distance(T, world.pose("book/body")) < 0.003


def test_a_book_does_not_fit_where_others_stand(world):
    for y in (SHELF.left_end + 0.02, SHELF.right_end - 0.02):
        world.set_free_pose("book/body", T_WORLD_SHELF @ se3.make(p=(0.005, y, BOOK.height)))
        assert overlaps(world) is not None


def test_a_book_stands_alone_on_the_table(world):
    T = se3.make(p=(0.0, 0.3, TABLE_HEIGHT + BOOK.height))
    world.set_free_pose("book/body", T)
    world.step(500)
    assert se3.rotation_distance(T, world.pose("book/body")) < 0.01


def test_a_book_weighs_what_paper_weighs(world):
    volume = np.prod([BOOK.thickness, BOOK.depth, BOOK.height])
    assert 0.8 < world.model.body("book/body").mass[0] / (500 * volume) < 1.01
