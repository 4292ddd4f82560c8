import sys

from imop.training import metrics
from imop.training.shards import write_shard
from tests.training.test_pairs import pair


def test_the_command_says_what_the_networks_reach_on_every_folder(tmp_path, monkeypatch, capsys):
    for name in ("first", "second"):
        (tmp_path / name).mkdir()
        write_shard([pair()], tmp_path / name / "a.npz")
    folders = [str(tmp_path / name) for name in ("first", "second")]
    monkeypatch.setattr(sys, "argv", ["metrics", "--shards", *folders, "--pairs", "1"])
    metrics.main()
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(":")[0] for line in lines] == ["first", "second"]
    assert all("region_iou" in line and "within_2cm_10deg" in line for line in lines)
