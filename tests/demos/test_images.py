import struct
import tracemalloc
import zlib

import numpy as np
import pytest
from PIL import Image

from imop.demos.images import MOST_PIXELS, read_depth, read_ids, read_rgb
from imop.errors import CorruptData


def save(path, codes):
    pixels = np.stack([codes // 65536, codes // 256 % 256, codes % 256], axis=-1).astype(np.uint8)
    Image.fromarray(pixels).save(path)


def test_depth_is_linear_between_the_planes(tmp_path, rng):
    codes = rng.integers(0, 2**24 - 1, (20, 30))
    codes[0, :2] = 0, 2**24 - 2
    save(tmp_path / "0.png", codes)
    depth = read_depth(tmp_path / "0.png", 0.01, 4.5)
    assert depth.dtype == np.float32 and depth.shape == (20, 30)
    np.testing.assert_allclose(depth, 0.01 + 4.49 * codes / (2**24 - 1), atol=3e-7)
    assert depth[0, 0] == np.float32(0.01)


def test_the_far_plane_is_no_measurement(tmp_path):
    save(tmp_path / "0.png", np.array([[2**24 - 1, 2**20]]))
    depth = read_depth(tmp_path / "0.png", 0.01, 4.5)
    assert depth[0, 0] == 0 and depth[0, 1] > 0


def test_millimetres_are_refused_but_not_a_view_of_nothing(tmp_path, rng):
    codes = rng.integers(0, 5000, (20, 30))
    codes[0, 0] = 2**24 - 1
    save(tmp_path / "0.png", codes)
    with pytest.raises(CorruptData, match="look like millimetres"):
        read_depth(tmp_path / "0.png", 0.01, 4.5)
    save(tmp_path / "0.png", np.full((20, 30), 2**24 - 1))
    assert not read_depth(tmp_path / "0.png", 0.01, 4.5).any()


def test_ids_use_all_three_bytes(tmp_path, rng):
    ids = rng.integers(0, 2**24, (10, 10))
    pixels = np.stack([ids % 256, ids // 256 % 256, ids // 65536], axis=-1).astype(np.uint8)
    Image.fromarray(pixels).save(tmp_path / "0.png")
    read = read_ids(tmp_path / "0.png")
    assert read.dtype == np.int32
    np.testing.assert_array_equal(read, ids)


def test_truncated(tmp_path, rng):
    path = tmp_path / "0.png"
    Image.fromarray(rng.integers(0, 256, (64, 64, 3), dtype=np.uint8)).save(path)
    content = path.read_bytes()
    flipped = content[:2000] + bytes([content[2000] ^ 1]) + content[2001:]
    cut = [content[:n] for n in (0, 4, 40, len(content) // 2, len(content) - 20)]
    for damaged in (*cut, flipped):
        path.write_bytes(damaged)
        with pytest.raises(CorruptData, match="not a readable image") as caught:
            read_rgb(path)
        assert caught.value.path == path


def test_missing_and_wrong_kind(tmp_path):
    with pytest.raises(CorruptData, match="missing"):
        read_rgb(tmp_path / "0.png")
    Image.fromarray(np.zeros((4, 4), np.uint8)).save(tmp_path / "1.png")
    with pytest.raises(CorruptData, match="mode L"):
        read_depth(tmp_path / "1.png", 0.01, 1.0)


def chunk(kind, content):
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))


def png(width, height, *chunks):
    header = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + header + b"".join(chunks) + chunk(b"IEND", b"")


@pytest.mark.parametrize("data", [(), [chunk(b"IDAT", zlib.compress(b""))], [chunk(b"IDAT", b"")]])
def test_without_image_data(tmp_path, data):
    path = tmp_path / "0.png"
    path.write_bytes(png(4, 4, *data))
    with pytest.raises(CorruptData, match="not a readable image") as caught:
        read_rgb(path)
    assert caught.value.path == path


def test_a_forged_size_costs_no_memory(tmp_path):
    path = tmp_path / "0.png"
    pixels = chunk(b"IDAT", zlib.compress(bytes(1000)))
    too_large = (16384, 10640), (2**31 - 1, 2**31 - 1), (MOST_PIXELS + 1, 1)
    for size, problem in [*((s, "at most") for s in too_large), ((5000, 5000), "are not in")]:
        path.write_bytes(png(*size, pixels))
        tracemalloc.start()
        with pytest.raises(CorruptData, match=problem):
            read_rgb(path)
        assert tracemalloc.get_traced_memory()[1] < 1e6
        tracemalloc.stop()


def test_other_formats_are_not_tried(tmp_path):
    Image.fromarray(np.zeros((4, 4, 3), np.uint8)).save(tmp_path / "0.png", format="BMP")
    with pytest.raises(CorruptData, match="not a readable image"):
        read_rgb(tmp_path / "0.png")


def test_pointer_of_git_lfs(tmp_path):
    path = tmp_path / "0.png"
    path.write_text("version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n")
    with pytest.raises(CorruptData, match=r"git LFS.*remedy.*git lfs pull"):
        read_rgb(path)
