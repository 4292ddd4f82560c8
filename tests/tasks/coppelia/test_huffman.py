import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from imop.errors import ModelFormatError
from imop.tasks.coppelia.huffman import decode
from tests.tasks.coppelia import writer


@given(st.binary(min_size=1, max_size=400), st.integers(0, 5))
def test_what_was_packed_comes_back(data, start):
    assert decode(b"?" * start + writer.huffman(data), start, len(data)) == data


def test_long_codes_and_many_chunks_come_back(rng):
    # Counts like Fibonacci's make codes longer than the table's window.
    counts = [1, 1]
    while len(counts) < 21:
        counts.append(counts[-1] + counts[-2])
    data = rng.permutation(np.repeat(np.arange(21, dtype=np.uint8), counts)).tobytes()
    data += rng.integers(0, 256, 60_000, dtype=np.uint8).tobytes()
    packed = writer.huffman(data)
    assert len(packed) > 2 * (1 << 15)
    assert decode(packed, 0, len(data)) == data


def test_a_single_symbol_takes_a_bit_each():
    packed = writer.huffman(b"\x07" * 20)
    assert len(packed) == 4
    assert decode(packed, 0, 20) == b"\x07" * 20


@pytest.mark.parametrize("cut", [0, 1, 5, 40])
def test_missing_codes_are_reported(cut, rng):
    data = rng.integers(0, 256, 300, dtype=np.uint8).tobytes()
    with pytest.raises(ModelFormatError, match="expected"):
        decode(writer.huffman(data)[:cut], 0, len(data))


def test_no_more_is_unpacked_than_the_bits_can_say():
    with pytest.raises(ModelFormatError, match="one bit for every byte"):
        decode(bytes([0xFF] * 10), 0, 1 << 30)


def test_a_tree_without_end_is_refused():
    with pytest.raises(ModelFormatError, match="tree"):
        decode(bytes(1000), 0, 10)


@given(st.binary(max_size=200), st.integers(0, 2000))
def test_any_bytes_are_decoded_or_refused(data, size):
    try:
        assert len(decode(data, 0, size)) == size
    except ModelFormatError as error:
        assert 0 <= error.offset <= len(data)
