"""Every model file as a scene: pictures to look at, seconds to read and convert, and what moves by itself.

python benchmarks/coppelia_models.py --models ../shared/data/rlbench_ttm --out FOLDER
"""

import json
import time
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import tyro
from PIL import Image, ImageDraw

from imop.sim.cameras import CAMERAS, look_at, render, render_view
from imop.sim.world import World, scene_spec
from imop.tasks.coppelia.cache import load_model
from imop.tasks.coppelia.convert import add_model

COLUMNS = 3
SIZE = (480, 360)


@dataclass
class Arguments:
    """What to look at, and where the pictures go."""

    models: Path
    """Folder of .ttm files."""
    out: Path
    """Folder for the pictures: NAME.png of each model, and contact_sheet.png."""
    only: str = ""
    """Models whose names contain this."""


def views(world: World) -> Image.Image:
    """The model from three sides, then from the front camera as the policy sees it."""
    near = [((0.95, -0.75, 1.5), 36.0), ((-0.35, -0.75, 1.6), 38.0), ((0.6, 0.9, 1.35), 38.0)]
    pictures = [render_view(world, look_at(eye, (0.25, 0.0, 0.9), fov), *SIZE) for eye, fov in near]
    small = render_view(world, CAMERAS["front"], 128, 128)
    pictures.append(np.asarray(Image.fromarray(small).resize((SIZE[1], SIZE[1]), Image.Resampling.NEAREST)))
    return Image.fromarray(np.concatenate(pictures, axis=1))


def drift(world: World, names: list[str]) -> dict[str, float]:
    """Metres that each body's origin moves in a second, for those that move by more than a centimetre."""
    before = {name: world.pose(name)[:3, 3] for name in names}
    world.step(round(1 / world.model.opt.timestep))
    moved = {name: float(np.linalg.norm(world.pose(name)[:3, 3] - p)) for name, p in before.items()}
    return {name: round(d, 3) for name, d in moved.items() if d > 0.01}


def measure(path: Path, out: Path) -> dict[str, Any]:
    """Seconds to a world, without and with a cache, and for all cameras; metres moved in a second."""
    seconds = {}
    with TemporaryDirectory() as cache:
        for name in ("cold", "cached"):
            start = time.perf_counter()
            model = load_model(path, Path(cache))
            spec = scene_spec()
            add_model(spec, model)
            world = World(spec)
            seconds[name] = time.perf_counter() - start
    render(world)
    start = time.perf_counter()
    render(world)
    seconds["observe"] = time.perf_counter() - start
    views(world).save(out / f"{path.stem}.png")
    moved = drift(world, [o.name for o in model.objects])
    return {"model": path.stem, **{k: round(v, 2) for k, v in seconds.items()}, "moved": moved}


def main(arguments: Arguments) -> None:
    arguments.out.mkdir(parents=True, exist_ok=True)
    paths = [p for p in sorted(arguments.models.glob("*.ttm")) if arguments.only in p.stem]
    rows = []
    for path in paths:
        rows.append(measure(path, arguments.out))
        print(json.dumps(rows[-1]), flush=True)
    if rows:
        total, worst = sum(row["cold"] for row in rows), max(row["cached"] for row in rows)
        print(f"all {len(rows)} cold: {total:.1f} s; slowest cached: {worst:.2f} s")
    sheet(paths, arguments.out)


def sheet(paths: list[Path], out: Path) -> None:
    """All models in one picture."""
    tiles = [Image.open(out / f"{path.stem}.png").crop((0, 0, *SIZE)) for path in paths]
    rows = -(-len(tiles) // 6)
    page = Image.new("RGB", (6 * SIZE[0], rows * SIZE[1]))
    for i, (tile, path) in enumerate(zip(tiles, paths, strict=True)):
        ImageDraw.Draw(tile).text((8, 8), path.stem, fill="white")
        page.paste(tile, (i % 6 * SIZE[0], i // 6 * SIZE[1]))
    page.save(out / "contact_sheet.png")


if __name__ == "__main__":
    main(tyro.cli(Arguments))
