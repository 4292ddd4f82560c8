"""Optional dependencies: the error about a missing one names the extra that brings it."""

from collections.abc import Iterator
from contextlib import contextmanager

from imop.errors import MissingExtra


@contextmanager
def extra(name: str) -> Iterator[None]:
    """Context for the imports of an extra; if one of them fails, the error names the extra.

    Raises:
        MissingExtra: if one of them is not installed.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        raise MissingExtra(str(error.name), name) from error
