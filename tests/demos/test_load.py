import pytest

from imop.demos.load import load_demonstrations
from imop.demos.store import DemonstrationStore
from imop.errors import CorruptData
from tests.demos.rlbench_files import write_episode
from tests.demos.scenes import assert_same, lift_a_cube

CAMERAS = ("front", "left_shoulder", "wrist")


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    made = DemonstrationStore.create(tmp_path_factory.mktemp("stores") / "store")
    made.append(lift_a_cube())
    made.append(lift_a_cube())
    return made.path


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return write_episode(tmp_path_factory.mktemp("data") / "lift" / "episode0", lift_a_cube())


def test_everything_of_a_store(store):
    assert len(load_demonstrations(store)) == 2
    (first,) = load_demonstrations(store, 1)
    assert_same(first, lift_a_cube())


def test_cameras_may_be_chosen(store, folder):
    for path in (store, folder):
        assert list(load_demonstrations(path, 1)[0].final.views) == list(CAMERAS)
        (chosen,) = load_demonstrations(path, 1, ["wrist", "front"])
        for k in chosen.keyframes:
            assert list(k.observation.views) == ["wrist", "front"]


def test_cameras_that_are_not_there_are_named_with_those_that_are(store, folder):
    for path in (store, folder):
        with pytest.raises(CorruptData, match=r"camera overhead.*front, left_shoulder, wrist"):
            load_demonstrations(path, 1, ["front", "overhead"])


def test_an_empty_store(tmp_path):
    with pytest.raises(CorruptData, match="no demonstration"):
        load_demonstrations(DemonstrationStore.create(tmp_path / "store").path)
