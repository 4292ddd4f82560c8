"""The pictures of the documentation, drawn by imop's own commands and made small.

    python benchmarks/pictures.py --out docs/pictures

`imop run` writes the steps and the video, `imop training regions` the region of recorded demonstrations, and
`imop training spreads` the spread, `imop tasks` the tasks. Some minutes on two cores.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import av
from PIL import Image

MOVING, STEPS, RECORDED = "tabletop/stack_cubes", "tabletop/open_drawer", "ring_on_peg"
SECONDS_A_FRAME = 0.1
"""Of the moving picture."""
COLORS = 64
"""Of a palette; it makes a picture of points a tenth as large."""


def imop(*arguments: object) -> None:
    """Call a command; what it cannot do ends the script."""
    subprocess.run([sys.executable, "-m", "imop.cli", *map(str, arguments)], check=True)


def save_still(source: Path, path: Path, rows: tuple[float, float] = (0.0, 1.0)) -> None:
    """Write a part of a picture, from one share of its height to another, in few colours."""
    with Image.open(source) as image:
        top, bottom = (round(share * image.height) for share in rows)
        part = image.convert("RGB").crop((0, top, image.width, bottom))
    part.quantize(COLORS, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(
        path, optimize=True
    )


def save_photograph(source: Path, path: Path) -> None:
    """Write a picture of rendered scenes as WebP."""
    with Image.open(source) as image:
        image.convert("RGB").save(path, quality=45, method=6)


def save_moving(video: Path, path: Path) -> None:
    """Write a video as an animated WebP that stays on its last frame for a while."""
    with av.open(str(video)) as container:
        frames = [Image.fromarray(frame.to_ndarray(format="rgb24")) for frame in container.decode(video=0)]
    frames = [*frames, frames[-1]]
    shown = [round(1000 * SECONDS_A_FRAME)] * (len(frames) - 1) + [1500]
    frames[0].save(
        path, save_all=True, append_images=frames[1:], duration=shown, loop=0, quality=70, method=6
    )


def main() -> None:
    """Make all of them."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("docs/pictures"))
    out = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        run, store, regions = (Path(folder, name) for name in ("run", "demos.zarr", "regions"))
        imop("run", "--task", MOVING, "--seed", 1, "--out", run)
        save_moving(run / "rollout.mp4", out / "rollout.webp")
        imop("run", "--task", STEPS, "--seed", 1, "--no-video", "--out", run)
        save_still(run / "steps.png", out / "steps.png", (0.0, 1 / 3))
        imop("collect", "--out", store, "--tasks", RECORDED, "--episodes", 3, "--scenes", 3, "--in-turn")
        imop("training", "regions", "--store", store, "--out", regions, "--count", 1)
        save_still(next(regions.glob("*.png")), out / "region.png", (2 / 5, 4 / 5))
        imop("training", "spreads", "--out", out / "spread.png")
        imop("tasks", "--contact-sheet", Path(folder, "tasks.png"))
        save_photograph(Path(folder, "tasks.png"), out / "tasks.webp")


if __name__ == "__main__":
    main()
