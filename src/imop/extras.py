"""Optional dependencies: what is not installed is named with the extra that brings it."""

from collections.abc import Iterator
from contextlib import contextmanager

from imop.errors import MissingExtra


@contextmanager
def extra(name: str) -> Iterator[None]:
    """Mark imports that belong to an extra, by its name; they stand in this context.

    Raises:
        MissingExtra: if one of them is not installed.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        raise MissingExtra(str(error.name), name) from error
