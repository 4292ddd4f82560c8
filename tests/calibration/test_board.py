import re

import numpy as np
import pytest
from PIL import Image

from imop.calibration.board import DPI, INCH, MARGIN, Board, save_board
from imop.calibration.command import BoardSizes
from imop.calibration.detect import detect_corners
from imop.errors import InvalidInput


def test_corners_are_numbered_as_opencv_numbers_them():
    board = Board(5, 7, 0.04, 0.03)
    assert np.allclose(board.corners, board.opencv().getChessboardCorners())


@pytest.mark.parametrize(
    ("sizes", "field"),
    [
        ({"square": 28.0, "marker": 21.0}, "board.square"),
        ({"marker": 0.028}, "board.marker"),
        ({"columns": 1}, "board"),
        ({"dictionary": "DICT_APRILTAG"}, "board.dictionary"),
        ({"columns": 20, "rows": 20}, "board.dictionary"),
    ],
)
def test_boards_that_cannot_be_drawn_are_refused_by_the_field(sizes, field):
    with pytest.raises(InvalidInput) as error:
        Board(**sizes)
    assert error.value.field == field


def test_what_is_printed_has_the_size_that_stands_on_it(tmp_path):
    board = Board(square=0.0213, marker=0.016)  # no whole number of dots
    size = save_board(board, tmp_path / "board.png")
    with Image.open(tmp_path / "board.png") as image:
        sheet, dpi = np.array(image.convert("RGB")), image.info["dpi"]
    assert np.allclose(dpi, DPI, atol=0.1)
    assert np.allclose(np.array(sheet.shape[1::-1]) / DPI * INCH, size)
    found = detect_corners(board, sheet)
    assert len(found.ids) == len(board.corners)
    metres = (found.pixels + 0.5) / DPI * INCH - MARGIN
    assert np.abs(metres - board.corners[found.ids, :2]).max() < 2e-4


def test_a_page_has_the_size_of_the_sheet(tmp_path):
    size = save_board(Board(), tmp_path / "board.pdf")
    page = re.search(rb"/MediaBox \[ ?0 0 ([\d.]+) ([\d.]+) ?\]", (tmp_path / "board.pdf").read_bytes())
    assert np.allclose([float(page[1]) / 72 * INCH, float(page[2]) / 72 * INCH], size, atol=1e-3)


def test_the_default_board_fits_onto_a4(tmp_path):
    width, height = save_board(Board(), tmp_path / "board.png")
    assert width < 0.297 and height < 0.210


def test_only_pictures_and_pages_are_written(tmp_path):
    with pytest.raises(InvalidInput, match="png"):
        save_board(Board(), tmp_path / "board.svg")


def test_the_command_line_draws_the_same_board_as_the_library():
    assert BoardSizes().board() == Board()
