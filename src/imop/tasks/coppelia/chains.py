"""Following a chain of jumps through an array with few steps of Python."""

import numpy as np

from imop.types import IntArray

_DOUBLINGS = 7


def chain(jump: IntArray, start: int) -> IntArray:
    """The positions that a walk visits: start, jump[start], jump[jump[start]], ...

    Codes of varying length can be told apart only one after the other. Here the lengths at all places are
    known first, 128 jumps are joined to one, the walk is made with these, and then the jumps between are
    filled in.

    Args:
        jump: (N,) where to go from each place, always forwards; N and beyond means out.
        start: where the walk begins, in 0 .. N.

    Returns:
        The places visited before the walk left, in order.
    """
    n = len(jump)
    levels = [np.append(np.minimum(jump, n), n).astype(np.int32)]
    for _ in range(_DOUBLINGS):
        levels.append(levels[-1][levels[-1]])
    far = levels.pop()
    heads, at = [], start
    while at < n:
        heads.append(at)
        at = int(far[at])
    places = np.array(heads, dtype=np.int32)
    for level in reversed(levels):
        places = np.stack([places, level[places]], axis=1).ravel()
    return places[places < n]
