"""A small model of our own, and the real files in a cache of the tests where they are."""

import pytest

from imop.tasks.coppelia.reader import read_model
from imop.tasks.rlbench import RLBENCH, assets
from imop.tasks.rlbench.scene import Scene
from tests.conftest import shared
from tests.tasks.coppelia.conftest import cupboard
from tests.tasks.coppelia.test_convert import world_of

FAST = ("open_drawer", "close_jar", "push_buttons", "open_door", "open_wine_bottle")
"""Tasks whose files `installed` provides; `installed_all` provides the others."""


@pytest.fixture
def scene():
    model = read_model(cupboard())
    return Scene(world_of(model), model)


def provide(folder, files):
    source = shared("rlbench_ttm")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(folder))
        for file in files:
            (folder / "from").mkdir(exist_ok=True)
            (folder / "from" / f"{file}.ttm").symlink_to(source / f"{file}.ttm")
        assets.install(folder / "from", files)
        yield


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    yield from provide(tmp_path_factory.mktemp("cache"), FAST)


@pytest.fixture(scope="module")
def installed_all(tmp_path_factory):
    yield from provide(tmp_path_factory.mktemp("cache"), [name.split("/")[1] for name in RLBENCH])
