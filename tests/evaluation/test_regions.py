import numpy as np
import pytest

from imop.demos.store import DemonstrationStore
from imop.errors import InvalidInput
from imop.evaluation.regions import draw, region_panels
from imop.geometry import se3
from tests.training.recorded.test_write import demonstration


def test_every_step_shows_its_region_and_pairs_that_moved_with_the_action():
    shown = [demonstration(number) for number in range(3)]
    panels = region_panels(shown)
    assert len(panels) == 2
    for step, panel in enumerate(panels):
        match = panel.action.match
        T_support, T_query = (d.keyframes[step].action.T_world_gripper for d in (shown[0], shown[-1]))
        moved = se3.apply(T_query @ se3.invert(T_support), match.p_support)
        assert 10 < len(match.p_support) <= len(match.region)
        assert np.linalg.norm(moved - match.p_query, axis=1).max() < 0.011
    assert "cube" in panels[0].title and "plate" in panels[1].title


def test_pictures_are_written_for_what_belongs_together(tmp_path):
    store = DemonstrationStore.create(tmp_path / "demos.zarr")
    for number in range(2):
        store.append(demonstration(number))
    paths = draw(store, tmp_path / "pictures", 3)
    assert [path.name for path in paths] == ["test-carry-0-3.png"]
    assert paths[0].read_bytes().startswith(b"\x89PNG")


def test_without_partners_there_is_nothing_to_draw():
    with pytest.raises(InvalidInput, match="partners"):
        region_panels([demonstration(0)])
