import numpy as np
import pytest

from imop.cli import main
from imop.demos.load import load_demonstrations
from imop.errors import CorruptData, InvalidInput
from imop.importing.side import read_side
from tests.recording import takes


def imop(*arguments):
    with pytest.raises(SystemExit) as stopped:
        main([str(a) for a in arguments])
    return stopped.value.code


def test_recorded_folders_are_imported_once(tmp_path, capsys):
    for name in ("a", "b"):
        takes.record(tmp_path / "takes" / name, last=None if name == "a" else 50)
    store = tmp_path / "s.zarr"
    assert imop("import", "folder", tmp_path / "takes", store, "--dry-run") == 0
    assert "nothing was stored" in capsys.readouterr().out and not store.exists()
    imop("import", "folder", tmp_path / "takes", store)
    assert "2 demonstrations imported" in capsys.readouterr().out
    imop("import", "folder", tmp_path / "takes", store)
    assert "0 demonstrations imported" in capsys.readouterr().out
    picture = tmp_path / "a.png"
    imop(
        "import",
        "folder",
        tmp_path / "takes",
        store,
        "--episode",
        "0",
        "--move",
        "1:+1",
        "--picture",
        picture,
    )
    assert len(load_demonstrations(store)) == 3 and picture.is_file()


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("rlbench", "--dry-run"), "dry_run"),
        (("folder", "--cameras", "front"), "side"),
        (("folder", "--remove", "1"), "episode"),
        (("folder", "--episode", "7"), "episode"),
        (("folder", "--side", "nowhere.toml"), "nowhere.toml"),
    ],
)
def test_bad_input_is_named(tmp_path, capsys, arguments, named):
    for name in ("a", "b"):
        takes.record(tmp_path / "takes" / name, last=3)
    layout, *rest = arguments
    assert imop("import", layout, tmp_path / "takes", tmp_path / "s.zarr", *rest) == 2
    assert named in capsys.readouterr().err


def test_a_side_file_overrides_what_a_folder_says(tmp_path, capsys):
    takes.record(tmp_path / "take")
    (tmp_path / "side.json").write_text(
        '{"cameras": {"front": {"intrinsics": {"fx": 11, "fy": 11, "cx": 6, "cy": 4}}}}'
    )
    imop("import", "folder", tmp_path / "take", tmp_path / "s.zarr", "--side", tmp_path / "side.json")
    (made,) = load_demonstrations(tmp_path / "s.zarr")
    np.testing.assert_allclose(made.final.views["front"].intrinsics[0, 0], 11)
    np.testing.assert_allclose(made.final.views["wrist"].intrinsics, takes.K)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("wrld = 'map'", "wrld: unknown"),
        ("joints = 'a'", "joints"),
        ("degrees = 1", "degrees"),
        ("[gripper]\npose_format = 'euler'", "gripper.pose_format"),
        ("[gripper]\nfingers = {a = [1, 1]}", "gripper.fingers"),
        ("[gripper]\ntip = 'a'", "gripper.tip: unknown"),
        ("[cameras.front]\nfov = 60", "cameras.front.fov: unknown"),
        ("[cameras.front]\nrgb = 3", "cameras.front.rgb"),
        ("[cameras.front]\ndepth_scale = 1000", "cameras.front.depth_scale"),
        ("[cameras", "cannot be read"),
    ],
)
def test_wrong_side_files_are_named(tmp_path, text, named):
    (tmp_path / "side.toml").write_text(text)
    with pytest.raises((InvalidInput, CorruptData), match=named):
        read_side(tmp_path / "side.toml")
