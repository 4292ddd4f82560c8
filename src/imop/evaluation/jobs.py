"""Work on several processes of this machine, with progress."""

from collections.abc import Iterator
from typing import Any

from joblib import Parallel
from rich.console import Console
from rich.progress import MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from imop.errors import InvalidInput


def check_jobs(jobs: int) -> int:
    """The number of processes.

    Raises:
        InvalidInput: if it is none.
    """
    if jobs < 1 and jobs != -1:
        raise InvalidInput("jobs", f"{jobs}", "a number of processes from 1 on, or -1 for one per core")
    return jobs


def parallel(work: list[Any], jobs: int, console: Console, title: str) -> Iterator[Any]:
    """Results of joblib's delayed calls in order, computed by `jobs` processes, with a progress bar.

    Raises:
        InvalidInput: for less than one process; otherwise what a call raises.
    """
    workers = Parallel(n_jobs=check_jobs(jobs), return_as="generator")
    columns = (TextColumn(title), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True) as progress:
        yield from progress.track(workers(work), total=len(work))
