"""What is not convex is taken apart, so that slots stay open."""

import sys

import numpy as np
import pytest

from imop.errors import MissingExtra
from imop.tasks.coppelia.parts import convex_parts, filled, is_convex
from imop.tasks.coppelia.reader import read_model
from tests.tasks.coppelia import writer
from tests.tasks.coppelia.test_convert import world_of

FLOOR, WALL = 0.02, 0.08
"""Heights of the slot's floor and of its walls, metres."""


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path


def slot():
    """A block with a slot along y, 4 cm wide: one closed mesh."""
    outline = [(-0.05, 0), (0.05, 0), (0.05, WALL), (0.02, WALL)]
    outline += [(0.02, FLOOR), (-0.02, FLOOR), (-0.02, WALL), (-0.05, WALL)]
    n = len(outline)
    vertices = np.array([(x, y, z) for y in (-0.05, 0.05) for x, z in outline])
    sides = [t for i in range(n) for j in [(i + 1) % n] for t in ((i, j, n + j), (i, n + j, n + i))]
    front = [(0, 5, 1), (1, 5, 4), (1, 4, 2), (2, 4, 3), (0, 7, 6), (0, 6, 5)]
    back = [(n + a, n + c, n + b) for a, b, c in front]
    return vertices, np.array([*sides, *front, *back])


def model():
    solid = writer.item("Gst", writer.leaf(0, 0))
    small = writer.item("Gst", writer.leaf(1, 3, (0.02, 0.02, 0.02)))
    return read_model(
        writer.ttm(
            writer.arrays(slot(), writer.box_mesh((0.02, 0.02, 0.02))),
            writer.dummy("base", 1, base=True, p=(0.3, 0, 0.75)),
            writer.shape("block", 2, 1, solid),
            writer.shape("cube", 3, 1, small, dynamic=True, p=(0, 0, 0.1)),
        )
    )


def test_what_hulls_would_fill_is_named():
    assert filled(model()) == ["block"]


def test_a_cube_falls_into_the_slot():
    pytest.importorskip("coacd")
    world = world_of(model())
    world.step(400)
    assert world.pose("cube")[2, 3] == pytest.approx(0.75 + FLOOR + 0.01, abs=0.003)


def test_parts_fill_the_piece_and_are_made_once(cache, monkeypatch):
    pytest.importorskip("coacd")
    piece = model()["block"].pieces[0]
    parts = convex_parts(piece)
    assert len(parts) > 1
    again = (corners[:, 2].max() for corners in parts if np.abs(corners[:, 0]).max() < 0.03)
    assert all(height < FLOOR + 0.003 for height in again), "nothing stands in the slot"
    monkeypatch.setitem(sys.modules, "coacd", None)
    assert all(np.array_equal(a, b) for a, b in zip(parts, convex_parts(piece), strict=True))
    (kept,) = (cache / "imop" / "parts").iterdir()
    kept.write_bytes(kept.read_bytes()[:20])
    with pytest.raises(MissingExtra):
        convex_parts(piece)


def test_without_coacd_the_error_names_its_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "coacd", None)
    with pytest.raises(MissingExtra, match=r"coacd.*imop\[sim\]"):
        world_of(model())


def test_boxes_and_flat_pieces_are_convex():
    flat = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    area = writer.item("Gst", writer.leaf(1, 0))
    file = writer.ttm(
        writer.arrays(writer.box_mesh(), (flat, [[0, 1, 2], [0, 2, 3]])),
        writer.shape("box", 1, -1, writer.item("Gst", writer.leaf(0, 0))),
        writer.shape("sheet", 2, -1, area),
    )
    found = read_model(file)
    assert all(is_convex(found[name].pieces[0]) for name in ("box", "sheet"))
