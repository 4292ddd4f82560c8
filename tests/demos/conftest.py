"""An episode in RLBench's layout that the tests write themselves."""

import pytest

from tests.demos.rlbench_files import write_episode
from tests.demos.scenes import lift_a_cube


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    root = tmp_path_factory.mktemp("data")
    return write_episode(root / "lift" / "all_variations" / "episodes" / "episode0", lift_a_cube())
