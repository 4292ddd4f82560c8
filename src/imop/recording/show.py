"""Keyframes for people to look at: a table for the terminal, and a picture of what was seen in each."""

from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont
from rich.table import Table

from imop.errors import InvalidInput
from imop.files import replaced
from imop.geometry.se3 import rotation_distance, translation_distance
from imop.recording.draft import Draft
from imop.types import ByteArray

_WIDTH, _CAPTION, _FONT = 240, 40, 13
"""Pixels of a picture's width, of what stands above it, and of its letters."""


def keyframes_table(draft: Draft) -> Table:
    """Number, frame, time, gripper, how far the hand came, and whether it may touch things on its way."""
    motion, frames, is_open = draft.source.motion, list(draft.frames), draft.gripper_open
    table = Table(caption="number 0 is where the demonstration begins")
    for name in ("number", "frame", "seconds", "gripper", "opening", "moved", "turned", "may touch"):
        table.add_column(name, justify="left" if name == "gripper" else "right")
    T = motion.T_world_gripper[frames]
    for number, frame in enumerate(frames):
        way, turn, touch = "", "", ""
        if number:
            way = f"{100 * float(translation_distance(T[number - 1], T[number])):.1f} cm"
            turn = f"{np.rad2deg(float(rotation_distance(T[number - 1], T[number]))):.0f}°"
            touch = "yes" if draft.may_touch[number - 1] else "no"
        seconds = f"{motion.times[frame] - motion.times[0]:.2f}"
        opening = f"{motion.gripper_opening[frame]:.2f}"
        table.add_row(f"{number}", f"{frame}", seconds, _gripper(draft, number), opening, way, turn, touch)
    if is_open[-1] or not is_open.any():
        return table
    table.caption = f"{table.caption}; it ends with the gripper closed: what it holds was not put anywhere"
    return table


def save_picture(draft: Draft, path: Path) -> None:
    """Draw what every camera saw at every keyframe, a row for each camera, and write a PNG.

    Raises:
        InvalidInput: if `path` does not end in .png, and as `Source.observation`.
        CorruptData: if an image is missing or damaged.
    """
    if path.suffix != ".png":
        raise InvalidInput("picture", str(path), "a file name that ends in .png")
    times = draft.source.motion.times
    columns = []
    for number, frame in enumerate(draft.frames):
        seen = draft.source.observation(frame, number)
        words = f"{number}: frame {frame}, {times[frame] - times[0]:.2f} s\n{_gripper(draft, number)}"
        pictures = [_small(view.rgb) for view in seen.views.values()]
        columns.append((words, pictures, list(seen.views)))
    heights = [max(column[1][row].height for column in columns) for row in range(len(columns[0][1]))]
    sheet = Image.new("RGB", (_WIDTH * len(columns), _CAPTION + sum(heights)), "white")
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(_FONT)
    for place, (words, pictures, names) in enumerate(columns):
        draw.multiline_text((place * _WIDTH + 4, 3), words, "black", font)
        top = _CAPTION
        for row, (small, name) in enumerate(zip(pictures, names, strict=True)):
            sheet.paste(small, (place * _WIDTH, top))
            draw.text((place * _WIDTH + 4, top + 3), name, "white", font, stroke_width=1, stroke_fill="black")
            top += heights[row]
    with replaced(path) as temporary:
        sheet.save(temporary, format="PNG")


def _gripper(draft: Draft, number: int) -> str:
    states = draft.gripper_open
    now = "open" if states[number] else "closed"
    if number and states[number] != states[number - 1]:
        return "opens" if states[number] else "closes"
    return now


def _small(rgb: ByteArray) -> Image.Image:
    image = Image.fromarray(rgb)
    return image.resize((_WIDTH, round(_WIDTH * image.height / image.width)))
