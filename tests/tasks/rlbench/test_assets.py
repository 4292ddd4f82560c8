import pytest

from imop.errors import AssetMissing, InvalidInput
from imop.tasks.env import make_task
from imop.tasks.rlbench import assets
from imop.tasks.task import make_scene
from tests.tasks.coppelia import writer
from tests.tasks.coppelia.conftest import cupboard


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


def test_a_missing_file_is_named_with_the_command_that_provides_it():
    with pytest.raises(AssetMissing, match=r"turn_tap\.ttm.*imop assets rlbench --from PATH"):
        make_scene(make_task("rlbench/turn_tap"), 0, 0, 0)
    assert not make_task("rlbench/turn_tap").available()


def test_all_files_are_found_anywhere_and_broken_ones_are_told(tmp_path):
    source = tmp_path / "rlbench" / "task_ttms"
    source.mkdir(parents=True)
    for name in ("lamp_on", "other"):
        (source / f"{name}.ttm").write_bytes(cupboard())
    (source / "open_box.ttm").write_bytes(cupboard()[:-9])
    done = assets.install(tmp_path, ["lamp_on", "open_box", "turn_tap"])
    assert done["lamp_on"].error == "" and "byte" in done["open_box"].error
    assert set(done) == {"lamp_on", "open_box", "other"}
    assert assets.available("lamp_on") and not assets.available("open_box")
    assert "waypoint0" in assets.load("lamp_on").index


def test_a_model_for_a_task_of_ones_own_is_there_and_what_it_lacks_is_said(tmp_path):
    source = tmp_path / "source"
    source.mkdir()
    jar = writer.ttm(writer.arrays(writer.box_mesh()), writer.shape("jar", 1))
    (source / "jar.ttm").write_bytes(jar)
    (source / "cupboard.ttm").write_bytes(cupboard())
    done = assets.install(source)
    assert assets.available("jar") and assets.available("cupboard")
    assert done["cupboard"].lacks == ()
    assert any("waypoint0" in lack for lack in done["jar"].lacks)


def test_a_changed_file_is_read_again(tmp_path):
    (tmp_path / "lamp_on.ttm").write_bytes(cupboard())
    assets.install(tmp_path, ["lamp_on"])
    first = assets.load("lamp_on")
    assert assets.load("lamp_on") is first
    assets.install(tmp_path, ["lamp_on"])
    assert assets.load("lamp_on").index == first.index


def test_a_folder_without_models_is_no_source(tmp_path):
    for path in (tmp_path, tmp_path / "none"):
        with pytest.raises(InvalidInput, match="RLBench"):
            assets.install(path, ["lamp_on"])


def test_a_pointer_of_git_lfs_is_named_and_not_installed(tmp_path):
    (tmp_path / "fridge.ttm").write_text("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n")
    done = assets.install(tmp_path)
    assert "git lfs pull" in done["fridge"].error and not assets.available("fridge")
