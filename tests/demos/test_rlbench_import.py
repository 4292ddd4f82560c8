import shutil

import pytest

from imop.cli import main
from imop.demos.rlbench import read_episode
from imop.demos.rlbench_import import import_rlbench
from imop.demos.store import DemonstrationStore
from imop.errors import InvalidInput
from tests.demos.rlbench_files import dump_demo, frames_of
from tests.demos.scenes import SYNTHETIC_CAMERAS, assert_same, lift_a_cube


@pytest.fixture
def three(written, tmp_path):
    """A task folder with three episodes that differ in their numbers."""
    episodes = tmp_path / "lift" / "all_variations" / "episodes"
    for i in range(3):
        shutil.copytree(written, episodes / f"episode{i}")
        dump_demo(episodes / f"episode{i}" / "low_dim_obs.pkl", frames_number(i))
    return episodes


def frames_number(i):
    frames = frames_of(lift_a_cube())
    return [frames[0] | {"joint_positions": frames[0]["joint_positions"] + 1e-6 * i}, *frames[1:]]


def test_import(written, tmp_path):
    out = tmp_path / "store"
    source = written.parents[2]
    done = import_rlbench(source, out)
    assert (done.stored, done.there_already, done.findings) == (1, 0, ())
    assert import_rlbench(source, out, ["front"], track=lambda folders: folders).stored == 1
    store = DemonstrationStore.open(out)
    assert_same(store[0], read_episode(written, SYNTHETIC_CAMERAS))
    assert list(store[1].final.views) == ["front"]


def test_import_refuses_other_folders(written, tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(InvalidInput, match="path"):
        import_rlbench(written, tmp_path, ["front"])
    with pytest.raises(InvalidInput, match="path"):
        import_rlbench(written, tmp_path / "notes.txt", ["front"])
    assert (tmp_path / "notes.txt").read_text() == "mine" and len(list(tmp_path.iterdir())) == 1
    with pytest.raises(InvalidInput, match="no episode"):
        import_rlbench(tmp_path, tmp_path / "out", ["front"])
    assert not (tmp_path / "out").exists()


def test_what_was_imported_is_not_imported_again(three, tmp_path):
    out = tmp_path / "store"
    assert import_rlbench(three / "episode1", out).stored == 1
    for source, stored, there_already in ((three, 2, 1), (three.parents[2], 0, 3)):
        done = import_rlbench(source, out)
        assert (done.stored, done.there_already) == (stored, there_already)
    assert len(DemonstrationStore.open(out)) == 3


def test_unreadable_episodes_do_not_stop_the_others(three, tmp_path):
    (three / "episode1" / "low_dim_obs.pkl").write_bytes(b"")
    done = import_rlbench(three, tmp_path / "store")
    assert done.stored == 2
    (finding,) = done.findings
    assert finding.severity == "error" and finding.where.endswith("episode1/low_dim_obs.pkl")


def test_what_check_calls_an_error_is_stored_and_said(three, tmp_path):
    frames = [f | {"gripper_pose": 1000 * f["gripper_pose"]} for f in frames_number(2)]
    dump_demo(three / "episode2" / "low_dim_obs.pkl", frames)
    done = import_rlbench(three, tmp_path / "store")
    assert done.stored == 3
    assert done.findings and all("episode2" in f.where and f.severity == "error" for f in done.findings)


def test_an_import_that_cannot_write_says_how_many_it_stored_and_can_be_continued(
    three, tmp_path, monkeypatch
):
    out, append = tmp_path / "store", DemonstrationStore.append

    def full(store, demonstration):
        if len(store) == 2:
            raise OSError(28, "No space left on device")
        return append(store, demonstration)

    monkeypatch.setattr(DemonstrationStore, "append", full)
    with pytest.raises(InvalidInput, match=r"out.*No space.*2 of 3 episodes were stored"):
        import_rlbench(three, out)
    monkeypatch.undo()
    done = import_rlbench(three, out)
    assert (done.stored, done.there_already) == (1, 2)
    assert len(DemonstrationStore.open(out)) == 3


def test_stores_of_version_1_are_not_filled_twice(three, tmp_path):
    from tests.demos.test_store import as_version_1

    out = tmp_path / "store"
    import_rlbench(three, out)
    as_version_1(out)
    assert import_rlbench(three, out).there_already == 3


def test_real_episodes_are_imported_once(rlbench_demos, tmp_path):
    source = rlbench_demos / "open_drawer" / "all_variations" / "episodes" / "episode4"
    results = [import_rlbench(source, tmp_path / "store") for _ in range(2)]
    assert [(r.stored, r.there_already, r.findings) for r in results] == [(1, 0, ()), (0, 1, ())]


@pytest.mark.parametrize(
    ("asked", "code", "said"),
    [
        ((), 0, "3 demonstrations imported"),
        (("--cameras", "wrist,front"), 0, "3 demonstrations imported"),
        (
            ("--cameras", "front,overhead"),
            1,
            "no images of camera overhead; remedy: ask for cameras that were",
        ),
        (("--cameras", "back"), 2, "cameras"),
    ],
)
def test_command_takes_cameras(three, tmp_path, capsys, asked, code, said):
    out = tmp_path / "store"
    with pytest.raises(SystemExit) as ended:
        main(["import", "rlbench", str(three), str(out), *asked])
    told = capsys.readouterr()
    assert ended.value.code == code
    assert said in " ".join((told.out + told.err).split())
    assert out.exists() == (code != 2)
    if code == 0:
        views = DemonstrationStore.open(out)[0].final.views
        assert list(views) == (asked[1].split(",") if asked else list(SYNTHETIC_CAMERAS))
