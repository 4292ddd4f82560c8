"""Waiting for whichever comes first."""

import asyncio
from collections.abc import Coroutine
from typing import Any, TypeVar

A = TypeVar("A")
B = TypeVar("B")


async def race(
    one: Coroutine[Any, Any, A], other: Coroutine[Any, Any, B], seconds: float | None = None
) -> tuple["asyncio.Task[A]", "asyncio.Task[B]"]:
    """Both, of which at least one is done if the time was enough; what is not done is cancelled."""
    tasks = asyncio.ensure_future(one), asyncio.ensure_future(other)
    try:
        await asyncio.wait(tasks, timeout=seconds, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
    return tasks
