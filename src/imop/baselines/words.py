"""Instructions as numbers: every word is hashed, so that words nobody has seen need no vocabulary."""

import re
import zlib

import numpy as np
from numpy.typing import NDArray

BUCKETS = 4096
LENGTH = 31
"""Words of an instruction that are read; longer ones are cut."""


def numbers_of(instruction: str) -> NDArray[np.int64]:
    """(LENGTH,) numbers from 1 to BUCKETS - 1 of the words in their order; 0 where there is none."""
    words = re.findall(r"[a-z0-9]+", instruction.lower())[:LENGTH]
    numbers = np.zeros(LENGTH, dtype=np.int64)
    numbers[: len(words)] = [1 + zlib.crc32(word.encode()) % (BUCKETS - 1) for word in words]
    return numbers
