"""A ChArUco board: a chessboard whose white squares carry markers, so that parts of it can be told apart."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from imop.errors import InvalidInput
from imop.extras import extra
from imop.files import replaced
from imop.types import ByteArray, FloatArray

if TYPE_CHECKING:
    import cv2

DPI = 300
"""Dots per inch of what is printed."""
INCH = 0.0254
"""Metres."""
MARGIN = 0.012
"""White paper around what is printed, metres; most printers leave less than this out."""
RULER = 0.1
"""Length of the line to measure after printing, metres."""
_LINE = 0.008
"""Height of a line of text, metres."""
_DICTIONARY = re.compile(r"DICT_([4-7])X\1_(50|100|250|1000)")
_QUIET = 0.5
"""A marker is at most this much smaller than its square ... (share); a smaller one is hard to read."""


@dataclass(frozen=True)
class Board:
    """A ChArUco board as OpenCV 4.6 and later draw it.

    The board's frame: origin at the outer corner of the first square, x along the row to the right, y down, z
    into the paper, so a camera that looks straight at an upright board has its own axes.

    Attributes:
        columns: squares in a row, at least 3.
        rows: rows of squares, at least 3.
        square: edge of a square, metres, as measured on the print.
        marker: edge of a marker, metres.
        dictionary: name of OpenCV's predefined dictionary of markers.

    Raises:
        InvalidInput: if no such board can be drawn.
    """

    columns: int = 8
    rows: int = 6
    square: float = 0.028
    marker: float = 0.021
    dictionary: str = "DICT_4X4_50"

    def __post_init__(self) -> None:
        if not (3 <= self.columns <= 40 and 3 <= self.rows <= 40):
            raise InvalidInput("board", f"{self.columns} x {self.rows} squares", "3 to 40 squares each way")
        if not 0.002 <= self.square <= 0.5:
            accepted = "the edge of one square in metres, 0.002 to 0.5; 30 mm are 0.03"
            raise InvalidInput("board.square", f"{self.square}", accepted)
        if not _QUIET * self.square <= self.marker <= 0.9 * self.square:
            accepted = "metres, half to nine tenths of the square"
            raise InvalidInput("board.marker", f"{self.marker} in a square of {self.square}", accepted)
        found = _DICTIONARY.fullmatch(self.dictionary)
        if found is None:
            accepted = "DICT_4X4_50 or another of OpenCV's dictionaries of 4X4 to 7X7 and 50 to 1000 markers"
            raise InvalidInput("board.dictionary", self.dictionary, accepted)
        if int(found[2]) < self.columns * self.rows // 2:
            problem = f"{self.dictionary} has too few markers for {self.columns} x {self.rows} squares"
            raise InvalidInput(
                "board.dictionary", problem, f"{self.columns * self.rows // 2} markers or more"
            )

    @property
    def size(self) -> tuple[float, float]:
        """Width and height, metres."""
        return self.columns * self.square, self.rows * self.square

    @property
    def corners(self) -> FloatArray:
        """(N, 3) inner corners in the board's frame, in the order of their numbers."""
        y, x = np.mgrid[1 : self.rows, 1 : self.columns] * self.square
        return np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)

    def opencv(self) -> "cv2.aruco.CharucoBoard":
        """The same board as OpenCV's object.

        Raises:
            MissingExtra: without OpenCV.
        """
        with extra("calibrate"):
            import cv2
        markers = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, self.dictionary))
        return cv2.aruco.CharucoBoard((self.columns, self.rows), self.square, self.marker, markers)

    def picture(self, pixels_per_square: int) -> ByteArray:
        """(rows * pixels_per_square, columns * pixels_per_square) grey levels of the bare board."""
        size = (self.columns * pixels_per_square, self.rows * pixels_per_square)
        return np.asarray(self.opencv().generateImage(size, marginSize=0), dtype=np.uint8)

    def __str__(self) -> str:
        return (
            f"ChArUco {self.columns} x {self.rows}, square {1000 * self.square:.4g} mm, "
            f"marker {1000 * self.marker:.4g} mm, {self.dictionary}"
        )


def save_board(board: Board, path: Path) -> tuple[float, float]:
    """Draw a board to be printed at its true size, with its sizes and a line to measure below it.

    Args:
        board: what to draw.
        path: .png (with its resolution in it) or .pdf.

    Returns:
        Width and height of the sheet, metres.

    Raises:
        InvalidInput: if `path` ends in anything else.
        MissingExtra: without OpenCV.
    """
    if path.suffix not in (".png", ".pdf"):
        raise InvalidInput("out", str(path), "a file name that ends in .png or .pdf")
    sheet = _sheet(board)
    with replaced(path) as temporary:
        sheet.save(temporary, format=path.suffix[1:].upper(), dpi=(DPI, DPI), resolution=DPI)
    return sheet.width / DPI * INCH, sheet.height / DPI * INCH


def _dots(metres: float) -> int:
    return round(metres / INCH * DPI)


def _sheet(board: Board) -> Image.Image:
    picture = board.picture(_dots(board.square))
    # A square is a whole number of dots, so that edges are sharp; the picture is then scaled to its size.
    width, height = (_dots(metres) for metres in board.size)
    drawn = Image.fromarray(picture).resize((width, height), Image.Resampling.LANCZOS)
    margin, line = _dots(MARGIN), _dots(_LINE)
    ruler = _dots(min(RULER, board.size[0]))
    sheet = Image.new("L", (width + 2 * margin, height + 2 * margin + 2 * line), 255)
    sheet.paste(drawn, (margin, margin))
    pen, font = ImageDraw.Draw(sheet), ImageFont.load_default(_dots(0.0035))
    top = margin + height + line
    pen.text((margin, top - line // 2), f"imop {board}; print at 100 %, glue onto something flat", 0, font)
    pen.line((margin, top + line, margin + ruler, top + line), 0, _dots(0.0004))
    for x in (margin, margin + ruler):
        pen.line((x, top + line // 2, x, top + line + line // 2), 0, _dots(0.0004))
    length = f"{1000 * min(RULER, board.size[0]):.4g} mm"
    pen.text((margin + ruler + line // 2, top + line // 2), f"{length}: measure this line", 0, font)
    return sheet
