"""Corrupted files are read as something else or refused, in bounded memory, and never with another error."""

import tracemalloc

import numpy as np
import pytest

from imop.errors import ModelFormatError
from imop.tasks.coppelia.model import Shape
from imop.tasks.coppelia.reader import read_body, read_model
from tests.tasks.coppelia.conftest import cupboard

MOST_MEMORY = 10e6


def corrupted(data, rng, first=0):
    """One of: a few bits turned, a few bytes replaced, cut, a piece doubled, a length made absurd."""
    raw = bytearray(data)
    kind = rng.integers(5)
    if kind == 0:
        for place in rng.integers(first, len(raw), rng.integers(1, 6)):
            raw[place] ^= 1 << rng.integers(8)
    elif kind == 1:
        for place in rng.integers(first, len(raw), rng.integers(1, 20)):
            raw[place] = rng.integers(256)
    elif kind == 2:
        del raw[rng.integers(first, len(raw)) :]
    elif kind == 3:
        a, b = np.sort(rng.integers(first, len(raw), 2))
        raw[a:a] = raw[a : min(b, a + 5000)]
    else:
        place = rng.integers(first, len(raw) - 4)
        raw[place : place + 4] = int(rng.choice([2**31 - 1, -1, 2**16, 0])).to_bytes(4, "little", signed=True)
    return bytes(raw)


def read_or_refuse(read, data):
    try:
        model = read(data)
    except ModelFormatError as error:
        assert 0 <= error.offset <= max(len(data), 1 << 25)
        return False
    assert all(o.parent < i for i, o in enumerate(model.objects))
    assert np.isfinite(model.T_world_moved).all()
    assert all(np.isfinite(o.corners).all() for o in model.objects if isinstance(o, Shape))
    return True


@pytest.mark.parametrize(("compress", "files"), [(False, 700), (True, 300)])
def test_corrupted_small_files(compress, files):
    rng = np.random.default_rng(int(compress))
    data = cupboard(compress=compress)
    # Without the header's zeros, which nobody reads.
    results = [read_or_refuse(read_model, corrupted(data, rng, first=1021)) for _ in range(files)]
    assert not all(results) and any(results)


def test_corrupted_bodies():
    rng = np.random.default_rng(2)
    data = cupboard()[1021:]
    results = [read_or_refuse(read_body, corrupted(data, rng)) for _ in range(800)]
    assert not all(results) and any(results)


def test_corrupted_real_files(rlbench_models):
    rng = np.random.default_rng(3)
    small = [p.read_bytes() for p in sorted(rlbench_models.glob("*.ttm")) if p.stat().st_size < 45_000]
    assert len(small) >= 4
    for k in range(200):
        read_or_refuse(read_model, corrupted(small[k % len(small)], rng))


def test_memory_is_bounded():
    rng = np.random.default_rng(4)
    data = cupboard()[1021:]
    tracemalloc.start()
    for _ in range(100):
        read_or_refuse(read_body, corrupted(data, rng))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < MOST_MEMORY
