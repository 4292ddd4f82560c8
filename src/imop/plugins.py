"""Tasks, suites and methods of one's own, found by name: nothing has to be registered.

A name is "module:object", looked for in the current folder and in what is installed, or the name of an entry
point of an installed package.
"""

import importlib
import inspect
import os
import sys
from importlib.metadata import entry_points
from typing import Any

from imop.errors import ImopError, InvalidInput


def find(field: str, name: str, group: str) -> Any:
    """The object that a name means; None if it is neither "module:object" nor the name of an entry point.

    Args:
        field: what errors call it.
        name: "module:object", or of an entry point.
        group: of the entry points.

    Raises:
        InvalidInput: if the module cannot be imported, or has no such object.
    """
    if ":" in name:
        return _imported(field, name)
    for entry in entry_points(group=group, name=name):
        return _imported(field, entry.value)
    return None


def takes_nothing(kind: Any) -> bool:
    """Whether a class or a function can be called without arguments."""
    try:
        inspect.signature(kind).bind()
    except (TypeError, ValueError):
        return False
    return True


def _imported(field: str, name: str) -> Any:
    module, _, attribute = name.partition(":")
    # Console scripts, and the workers of joblib, do not look in the current folder.
    if os.getcwd() not in sys.path:
        sys.path.insert(0, os.getcwd())
    try:
        found: Any = importlib.import_module(module)
        for part in attribute.split("."):
            found = getattr(found, part)
    except ImopError:
        raise
    except Exception as error:  # whatever somebody's module does when it is imported
        problem = f"{name} cannot be imported ({type(error).__name__}: {error})"
        accepted = "module:object, of a module in the current folder or an installed package"
        raise InvalidInput(field, problem, accepted) from error
    return found
