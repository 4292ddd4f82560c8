"""Read RLBench's pickles without RLBench, and without running what a pickle may ask for."""

import pickle
from pathlib import Path
from typing import Any, Self

import numpy as np

from imop.errors import CorruptData


class Record:
    """Holds the attributes that a pickled RLBench object had; knows nothing else."""

    fields: dict[str, Any]

    def __new__(cls) -> Self:
        """An empty record; pickle makes objects without calling `__init__`."""
        record = super().__new__(cls)
        record.fields = {}
        return record

    # Without this method pickle would write into __dict__ of whatever it is pointed at, this class included.
    def __setstate__(self, state: dict[str, Any]) -> None:
        self.fields = dict(state)


class DemoRecord(Record):
    """Stands for rlbench.demo.Demo."""


class ObservationRecord(Record):
    """Stands for rlbench.backend.observation.Observation."""


_reconstruct = np.empty(0).__reduce__()[0]

ALLOWED: dict[tuple[str, str], Any] = {
    ("rlbench.demo", "Demo"): DemoRecord,
    ("rlbench.backend.observation", "Observation"): ObservationRecord,
    ("numpy", "ndarray"): np.ndarray,
    ("numpy", "dtype"): np.dtype,
    ("numpy.core.multiarray", "_reconstruct"): _reconstruct,
    ("numpy._core.multiarray", "_reconstruct"): _reconstruct,
}


class _Forbidden(Exception):
    pass


class _Unpickler(pickle.Unpickler):
    def find_class(self, module: str, name: str) -> Any:
        try:
            return ALLOWED[module, name]
        except KeyError:
            raise _Forbidden(f"{module}.{name}") from None


def load(path: Path) -> Any:
    """The object pickled in the file `path`; RLBench's objects come as `DemoRecord` and `ObservationRecord`.

    Raises:
        CorruptData: if the file is missing, truncated, not a pickle, or names any class or function
            that RLBench's own files do not name (nothing of it is called then).
    """
    try:
        with path.open("rb") as file:
            return _Unpickler(file).load()
    except _Forbidden as error:
        raise CorruptData(
            path,
            f"the pickle asks for {error}, which RLBench's files do not contain",
            "do not trust this file",
        ) from None
    except FileNotFoundError:
        raise CorruptData(path, "the file is missing") from None
    except Exception as error:  # a damaged pickle can fail in any way at all
        raise CorruptData(path, f"not a readable pickle ({type(error).__name__}: {error})") from error
