"""Pickles that RLBench's own classes can be made from, written without RLBench."""

import io
import pickle
from typing import Any

import numpy as np


class Demo:
    """Stands for rlbench.demo.Demo; its attributes become those of the real class."""

    def __init__(self, **attributes: Any):
        self.__dict__.update(attributes)


class Observation:
    """Stands for rlbench.backend.observation.Observation."""

    def __init__(self, **attributes: Any):
        self.__dict__.update(attributes)


_reconstruct = np.empty(0).__reduce__()[0]

_NAMES: dict[Any, tuple[str, str]] = {
    Demo: ("rlbench.demo", "Demo"),
    Observation: ("rlbench.backend.observation", "Observation"),
    # The name that numpy 1, which RLBench's users have, knows as well as numpy 2.
    _reconstruct: ("numpy.core.multiarray", "_reconstruct"),
}


# Only the Python implementation lets a class be written under a name that cannot be imported here.
class _Pickler(pickle._Pickler):
    def save_global(self, obj: Any, name: str | None = None) -> None:
        if obj not in _NAMES:
            super().save_global(obj, name)  # type: ignore[misc]
            return
        for part in _NAMES[obj]:
            self.save(part)  # type: ignore[attr-defined]
        self.write(pickle.STACK_GLOBAL)  # type: ignore[attr-defined]
        self.memoize(obj)  # type: ignore[attr-defined]


def dumps(value: Any) -> bytes:
    """`value` as RLBench itself would pickle it (protocol 4)."""
    stream = io.BytesIO()
    _Pickler(stream, protocol=4).dump(value)
    return stream.getvalue()
