import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from imop.errors import ModelFormatError
from imop.tasks.coppelia.arrays import SharedArrays, packed_indices
from imop.tasks.coppelia.sections import Values, read_section
from tests.tasks.coppelia import writer


@given(st.lists(st.integers(0, 2**28), max_size=60).map(lambda v: v[: len(v) // 3 * 3]))
def test_packed_indices_come_back(values):
    data = writer.packed(values)
    assert packed_indices(Values(data, 0, len(data))).ravel().tolist() == values


def test_fewer_packed_numbers_than_announced_are_refused():
    data = writer.packed([1, 2, 3])
    with pytest.raises(ModelFormatError, match="packed"):
        packed_indices(Values(data, 0, len(data) - 1))
    with pytest.raises(ModelFormatError):
        packed_indices(Values(writer.ints(2**30), 0, 4))


def shared(triangles):
    vertices = np.zeros((4, 3))
    data = writer.arrays((vertices, triangles))[7:]
    return SharedArrays(read_section(data, 0, len(data))[0])


def test_a_triangle_of_a_missing_vertex_is_refused():
    assert shared([[0, 1, 3]]).mesh(0, 0, 0)[1].tolist() == [[0, 1, 3]]
    for triangle in ([0, 1, 4], [0, -1, 2]):
        with pytest.raises(ModelFormatError, match="vertex"):
            shared([triangle]).mesh(0, 0, 0)


def test_lists_that_are_not_there_are_refused():
    with pytest.raises(ModelFormatError) as error:
        shared([[0, 1, 2]]).mesh(0, 1, 77)
    assert error.value.offset == 77


def test_meshes_with_the_same_numbers_share_their_arrays():
    lists = shared([[0, 1, 2]])
    assert lists.mesh(0, 0, 0)[0] is lists.mesh(0, 0, 0)[0]
