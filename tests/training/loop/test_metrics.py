import pytest

from imop.cli import main
from imop.training.data.shards import write_shard
from tests.training.data.test_pairs import pair


def test_the_command_says_what_the_networks_reach_on_every_folder(tmp_path, capsys):
    for name in ("first", "second"):
        (tmp_path / name).mkdir()
        write_shard([pair()], tmp_path / name / "a.npz")
    folders = [str(tmp_path / name) for name in ("first", "second")]
    with pytest.raises(SystemExit) as ended:
        main(["training", "metrics", "--shards", *folders, "--pairs", "1"])
    assert not ended.value.code
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(":")[0] for line in lines] == ["first", "second"]
    assert all("region_iou" in line and "within_2cm_10deg" in line for line in lines)
