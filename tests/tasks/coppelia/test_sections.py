import pytest
from hypothesis import given
from hypothesis import strategies as st

from imop.errors import ModelFormatError
from imop.tasks.coppelia.sections import Values, read_section
from tests.tasks.coppelia.writer import doubles, floats, ints, item, section, text


def test_items_nested_sections_and_unknown_tags_are_read():
    data = section(item("Aaa", ints(7)), item("???", b"x" * 9), item("Bbb", section(item("Ccc", text("hé")))))
    found, end = read_section(data, 0, len(data))
    assert end == len(data)
    assert found.require("Aaa").one_int() == 7
    assert found.inner("Bbb").text("Ccc") == "hé"
    assert found.get("Zzz") is None


def test_new_files_write_wide_floats_under_another_tag():
    old = section(item("Cfq", floats(1, 2)))
    new = section(item("_fq", doubles(1, 2)))
    for data in (old, new):
        assert read_section(data, 0, len(data))[0].require("Cfq").floats(2).tolist() == [1, 2]


@pytest.mark.parametrize("length", [-1, 5, 2**31 - 1])
def test_lengths_beyond_the_section_are_refused(length):
    data = b"Aaa" + ints(length) + b"1234" + b"EOO"
    with pytest.raises(ModelFormatError) as error:
        read_section(data, 0, len(data) - 3)
    assert error.value.offset == 3


def test_a_missing_terminator_is_refused():
    data = item("Aaa", b"12")
    with pytest.raises(ModelFormatError, match="EOO"):
        read_section(data, 0, len(data))


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), 1e30])
def test_numbers_that_are_none_are_refused(bad):
    data = floats(bad)
    with pytest.raises(ModelFormatError):
        Values(data, 0, len(data)).floats(1)


def test_a_rotation_of_no_length_is_refused():
    data = floats(*([0] * 7))
    with pytest.raises(ModelFormatError, match="quaternion"):
        Values(data, 0, len(data)).pose(position_first=True)


def test_reading_beyond_the_payload_is_refused_and_says_where():
    data = b"....." + ints(1)
    values = Values(data, 5, 9)
    assert values.one_int() == 1
    with pytest.raises(ModelFormatError) as error:
        values.one_int()
    assert error.value.offset == 9


@given(st.binary(max_size=120))
def test_any_bytes_are_a_section_or_refused(data):
    try:
        found, end = read_section(data, 0, len(data))
    except ModelFormatError as error:
        assert 0 <= error.offset <= len(data)
    else:
        assert data[end - 3 : end] == b"EOO"
        assert all(0 <= a <= b <= len(data) for _, a, b in found.items)
