import io

import numpy as np
import pytest
from PIL import Image
from rich.console import Console

from imop.errors import InvalidInput
from imop.evaluation.contact_sheet import SCENES, picture, save_contact_sheet, tasks_table
from imop.tasks.suites import SUITES

DRAWER = "tabletop/open_drawer"


def test_the_sheet_has_a_row_for_each_task(tmp_path):
    heights = []
    for tasks in ([DRAWER], [DRAWER, "tabletop/lid_off_pot"]):
        save_contact_sheet(tasks, tmp_path / "sheet.png", 1, Console(quiet=True))
        with Image.open(tmp_path / "sheet.png") as image:
            pixels = np.asarray(image.convert("RGB"))
        heights.append(image.height)
        columns = np.array_split(pixels, SCENES, axis=1)
        assert all(column.std() > 20 for column in columns)
    assert heights[1] == 2 * heights[0]


def test_scenes_differ():
    assert not np.array_equal(picture(DRAWER, 0, 0), picture(DRAWER, 0, 1))


def test_only_png_is_written(tmp_path):
    with pytest.raises(InvalidInput, match=r"\.png"):
        save_contact_sheet([DRAWER], tmp_path / "sheet.bmp", 1, Console(quiet=True))


def test_the_table_tells_split_variations_and_instructions():
    console = Console(width=200, record=True, file=io.StringIO())
    console.print(tasks_table(list(SUITES["tabletop"]["all"]), "tabletop"))
    text = console.export_text()
    assert "open the bottom drawer" in text and "open the top drawer" in text
    assert (
        "base, 3 variations" in text
        and "cross_object, 9 variations" in text
        and "put the crackers in the cupboard" in text
    )
