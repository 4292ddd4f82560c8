import numpy as np
import pytest

from imop.errors import ModelFormatError
from imop.tasks.coppelia import cache
from tests.tasks.coppelia.conftest import cupboard


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "cupboard.ttm"
    path.write_bytes(cupboard(compress=True))
    return path


def test_a_file_is_unpacked_once(file, tmp_path, monkeypatch):
    first = cache.load_model(file, tmp_path / "cache")
    monkeypatch.setattr(cache, "unpack", None)
    second = cache.load_model(file, tmp_path / "cache")
    assert np.array_equal(first.T_world_moved, second.T_world_moved)


def test_other_contents_are_another_model(file, tmp_path):
    cache.load_model(file, tmp_path / "cache")
    file.write_bytes(cupboard())
    cache.load_model(file, tmp_path / "cache")
    assert len(list((tmp_path / "cache").iterdir())) == 2


def test_a_spoilt_cache_is_made_again(file, tmp_path):
    cache.load_model(file, tmp_path / "cache")
    (kept,) = (tmp_path / "cache").iterdir()
    good = kept.read_bytes()
    kept.write_bytes(good[:-10])
    cache.load_model(file, tmp_path / "cache")
    assert kept.read_bytes() == good


def test_broken_files_leave_nothing(tmp_path):
    path = tmp_path / "broken.ttm"
    path.write_bytes(cupboard()[:-1])
    with pytest.raises(ModelFormatError):
        cache.load_model(path, tmp_path / "cache")
    assert not (tmp_path / "cache").exists()


def test_a_folder_that_cannot_be_made_is_no_matter(file, tmp_path):
    (tmp_path / "cache").write_text("a file, not a folder")
    assert cache.load_model(file, tmp_path / "cache").index["drawer"] >= 0
