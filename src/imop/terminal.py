"""What commands print to."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TypeVar

from rich.console import Console
from rich.markup import escape
from rich.status import Status
from rich.text import Text

# Names and messages may hold brackets and colons, which must be shown as they are.
console = Console(markup=False, emoji=False, highlight=False)
T = TypeVar("T")


def track(these: Sequence[T], doing: str) -> Iterable[T]:
    """The same, with progress while they are worked on."""
    from rich.progress import track

    return track(these, escape(doing), console=console, transient=True)


def status(doing: str) -> Status:
    """Says what is being done, while it is done."""
    return console.status(Text(doing))


def list_folder(folder: Path) -> None:
    """Print the files of a folder."""
    for path in sorted(folder.iterdir()):
        console.print(f"  {path}", soft_wrap=True)
