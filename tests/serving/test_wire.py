import msgpack
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from imop.errors import InvalidInput
from imop.serving.wire import pack, unpack

ARRAYS = arrays.arrays(
    st.sampled_from(["?", "|u1", "<i4", ">i4", "<f4", "<f8", ">f8", "<f2", "<u8"]),
    arrays.array_shapes(min_dims=0, max_dims=4, min_side=0, max_side=4),
)
LEAVES = st.none() | st.booleans() | st.integers(-(2**63), 2**64 - 1) | st.floats() | st.text() | ARRAYS
VALUES = st.recursive(
    LEAVES,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
    max_leaves=8,
)


def same(a, b):
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if isinstance(a, list):
        return len(a) == len(b) and all(map(same, a, b))
    return a == b or (a != a and b != b)


@given(VALUES)
def test_what_is_packed_comes_back(value):
    assert same(value, unpack(pack(value)))


@pytest.mark.parametrize("number", [np.float32(0.1), np.int16(-3), np.bool_(True)])
def test_numpy_scalars_come_back_with_their_type(number):
    back = unpack(pack(number))
    assert back == number and back.dtype == number.dtype


@pytest.mark.parametrize("value", [np.array([object()]), np.array(["a"]), 1j, {1, 2}, object(), 2**70])
def test_what_has_no_place_in_a_message_is_refused(value):
    with pytest.raises(InvalidInput, match="message"):
        pack(value)


def test_an_array_that_is_not_contiguous_arrives_as_it_is():
    array = np.arange(24.0).reshape(4, 6)[::2, ::-1].T
    assert (unpack(pack(array)) == array).all()


def forged(**changes):
    fields = {"__ndarray__": True, "data": b"12345678", "dtype": "<f8", "shape": [1]} | changes
    return msgpack.packb({key.encode(): value for key, value in fields.items()})


def test_the_unforged_array_is_read():
    assert unpack(forged()).shape == (1,)


@pytest.mark.parametrize(
    "changes",
    [
        {"shape": [2]},
        {"shape": [-1]},
        {"shape": [2**40, 2**40]},
        {"shape": [1.0]},
        {"shape": [True]},
        {"shape": [1] * 5},
        {"shape": None},
        {"shape": 1},
        {"data": b""},
        {"data": "12345678"},
        {"data": None},
        {"dtype": "|O"},
        {"dtype": "<U2"},
        {"dtype": "<c16"},
        {"dtype": "<M8[s]"},
        {"dtype": "f8,f8"},
        {"dtype": "(2,)f4"},
        {"dtype": "nonsense"},
        {"dtype": ",,("},
        {"dtype": None},
        {"dtype": 8},
        {"dtype": "x" * 10_000},
    ],
    ids=str,
)
def test_forged_arrays_are_refused_in_few_words(changes):
    with pytest.raises(InvalidInput, match="message") as refused:
        unpack(forged(**changes))
    assert len(str(refused.value)) < 500


@pytest.mark.parametrize(
    "message",
    [
        b"",
        b"\xc1",
        b"\x81\x01\x02",  # a map whose key is a number
        b"\x81\xa1\xff\x00",  # a key that is no UTF-8
        b"\x91" * 100_000 + b"\xc0",  # nested
        b"\xdd\xff\xff\xff\xff",  # a list of 4 billion
        b"\xdf\xff\xff\xff\xff",
        b"\xdc\x4e\x20" + b"\xc0" * 20_000,
        b"\xd4\x05\x00",  # an extension
        b"\xc0\xc0",  # two messages
        b"GET / HTTP/1.1",
    ],
)
def test_garbage_is_named_as_such(message):
    with pytest.raises(InvalidInput, match="message"):
        unpack(message)


@given(st.data())
@settings(max_examples=100)
def test_damaged_messages_are_read_or_refused(data):
    message = bytearray(
        pack({"views": {"front": np.arange(6.0)}, "n": [1, 2.5, None, "text"], "f": np.float32(1)})
    )
    for _ in range(data.draw(st.integers(1, 4))):
        message[data.draw(st.integers(0, len(message) - 1))] = data.draw(st.integers(0, 255))
    cut = data.draw(st.integers(0, len(message)))
    for damaged in (bytes(message), bytes(message[:cut])):
        try:
            unpack(damaged)
        except InvalidInput as refused:
            assert len(str(refused)) < 1_000
