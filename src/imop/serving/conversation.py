"""One client's connection: a message, a reply, and so on, until either side ends it."""

import asyncio
import logging
import time
import traceback
from collections.abc import Coroutine
from dataclasses import dataclass
from typing import Any, TypeVar

from imop.errors import ImopError, InvalidInput
from imop.extras import extra
from imop.serving.limits import Limits, TimeLimitExceeded, WorkerEnded
from imop.serving.racing import race
from imop.serving.session import Outcome, Reply
from imop.serving.workers import Host, Worker

with extra("serve"):
    from websockets.asyncio.server import ServerConnection
    from websockets.frames import CloseCode

logger = logging.getLogger(__name__)
T = TypeVar("T")


@dataclass(frozen=True)
class Shared:
    """What all conversations of a server have in common.

    Attributes:
        host: where sessions come from.
        limits: of each of them.
        turn: admits as many requests as are worked on at once, in the order in which they came.
        stopping: whether the server is shutting down.
        metadata: the first message to every client.
    """

    host: Host
    limits: Limits
    turn: asyncio.Semaphore
    stopping: asyncio.Event
    metadata: bytes


class Conversation:
    """Holds one conversation; its process is started by the first request."""

    def __init__(self, client: ServerConnection, shared: Shared):
        self._client, self._shared = client, shared
        self._worker: Worker | None = None

    async def hold(self) -> None:
        """Answer until the client leaves, makes an error or is idle for too long, or the server stops.

        Raises:
            ConnectionClosed: when the client leaves, or sends what is no websocket's message.
        """
        try:
            await self._send(self._shared.metadata)
            await self._answer_all()
        except TimeoutError:
            await self._client.close(CloseCode.POLICY_VIOLATION, "idle for too long")
        finally:
            self._end_worker()

    async def _answer_all(self) -> None:
        prev_total_ms = 0.0
        while (message := await self._next()) is not None:
            started = time.perf_counter()
            reply = await self._while_connected(self._reply(message, prev_total_ms))
            del message
            if reply is None:
                return
            if reply.outcome is Outcome.ANSWERED:
                await self._send(reply.content)
            else:
                await self._send_error(reply.content.decode())
            if reply.outcome is Outcome.FAILED:
                await self._client.close(CloseCode.INTERNAL_ERROR, "the frame before says what went wrong")
                return
            prev_total_ms = (time.perf_counter() - started) * 1e3
        await self._client.close(CloseCode.GOING_AWAY, "the server is shutting down")

    async def _next(self) -> str | bytes | None:
        """The client's next message, or None if the server stops before it is there.

        Raises:
            TimeoutError: if it takes too long.
        """
        seconds = self._shared.limits.idle_seconds
        received, stopped = await race(self._client.recv(), self._shared.stopping.wait(), seconds)
        if not received.cancelled():
            return received.result()
        if not stopped.cancelled():
            return None
        raise TimeoutError

    async def _send(self, message: bytes | str) -> None:
        async with asyncio.timeout(self._shared.limits.idle_seconds):
            await self._client.send(message)

    async def _send_error(self, text: str) -> None:
        # Quoted, for it may repeat what a stranger sent.
        logger.warning("%s: %r", self._client.remote_address, text.strip().rpartition("\n")[2])
        await self._send(text)

    async def _while_connected(self, asked: Coroutine[Any, Any, T]) -> T | None:
        """What is asked for, or None if the client leaves first: nobody shall work for who is gone."""
        answer, _ = await race(asked, self._client.wait_closed())
        return None if answer.cancelled() else answer.result()

    async def _reply(self, message: str | bytes, prev_total_ms: float) -> Reply:
        if isinstance(message, str):
            return _failed(InvalidInput("message", "a text", "one msgpack message in a binary frame"))
        limit = self._shared.limits.request_seconds
        arrived = time.perf_counter()
        async with self._shared.turn:
            wait_ms = (time.perf_counter() - arrived) * 1e3
            try:
                async with asyncio.timeout(limit):
                    if self._worker is None:
                        self._worker = await self._shared.host.session()
                    return await self._worker.ask(message, wait_ms, prev_total_ms)
            except TimeoutError:
                # Before the turn passes on: what took too long shall not go on beside the next one.
                self._end_worker()
                return _failed(TimeLimitExceeded(limit))
            except WorkerEnded as error:
                return _failed(error)

    def _end_worker(self) -> None:
        if self._worker is not None:
            self._worker.end()
            self._worker = None


def _failed(error: ImopError) -> Reply:
    """An error of ours, in the form of the last lines of a traceback."""
    return Reply(Outcome.FAILED, "".join(traceback.format_exception_only(error)).encode())
