import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from imop.tasks.coppelia.chains import chain


@given(st.lists(st.integers(1, 5), max_size=600), st.integers(0, 600))
def test_the_walk_is_that_of_a_loop(steps, start):
    jump = np.arange(len(steps), dtype=np.int32) + np.array(steps, dtype=np.int32)
    visited, at = [], start
    while at < len(jump):
        visited.append(at)
        at = int(jump[at])
    assert chain(jump, min(start, len(jump))).tolist() == visited
