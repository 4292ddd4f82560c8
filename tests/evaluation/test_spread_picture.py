import numpy as np
import pytest
from PIL import Image

from imop.errors import InvalidInput
from imop.evaluation.spread_picture import Panel, first_region, save_spreads
from imop.evaluation.trials import Trial, demonstration_for
from imop.geometry.cloud import PointCloud
from imop.geometry.neighbours import within
from imop.networks.model import load_model
from imop.policy.region import Region


@pytest.fixture(scope="module")
def demonstration():
    return demonstration_for(Trial("tabletop/open_drawer", 0))


def region_of(keyframe, spread):
    """A patch beside where the gripper goes."""
    grid = np.stack(np.meshgrid(*2 * [np.linspace(-0.05, 0.05, 40)]), axis=-1).reshape(-1, 2)
    points = keyframe.action.T_world_gripper[:3, 3] + np.column_stack([grid, np.zeros(len(grid))])
    colors = np.zeros((len(points), 3), dtype=np.float32)
    return Region(
        PointCloud(points, colors, np.zeros(len(points), dtype=np.int32)),
        np.ones(len(points)),
        np.zeros((0, 3)),
        spread=np.full(len(points), spread),
    )


def test_a_wide_spread_is_yellow_and_a_narrow_one_violet(demonstration, tmp_path):
    step = demonstration.keyframes[0]
    panels = [
        Panel(name, step, region_of(step, spread)) for name, spread in (("narrow", 0.001), ("wide", 0.05))
    ]
    save_spreads(panels, tmp_path / "spread.png")
    with Image.open(tmp_path / "spread.png") as image:
        pixels = np.asarray(image.convert("RGB")).astype(int)
    # Without the colour bar at the right.
    narrow, wide = np.array_split(pixels[:, : int(pixels.shape[1] * 0.88)], 2, axis=1)

    def covered(half, color):
        return (np.abs(half - color).max(axis=-1) < 12).sum()

    violet, yellow = (68, 1, 84), (253, 231, 37)
    assert covered(narrow, violet) > 1000 > 10 * covered(narrow, yellow)
    assert covered(wide, yellow) > 1000 > 10 * covered(wide, violet)
    assert (tmp_path / "spread.png").stat().st_size < 300_000


def test_the_region_of_the_first_step_is_of_its_scene_and_has_a_spread(demonstration):
    region = first_region(load_model(), demonstration)
    assert region.spread is not None and region.spread.shape == (len(region.cloud),)
    goal = demonstration.keyframes[0].action.T_world_gripper[None, :3, 3]
    assert within(goal, region.cloud.points, 0.2).all()


def test_only_png_is_written(tmp_path):
    with pytest.raises(InvalidInput, match=r"\.png"):
        save_spreads([], tmp_path / "spread.jpg")
