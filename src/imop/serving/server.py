"""The websocket server: who may connect, and how it begins and ends.

Nothing of a client's message is read here: the session's own process unpacks it, so that the event loop is
always free. Requests are worked on in the order in which they arrived, as many at once as there are cores. A
session has one at a time, so that each gets its turn.
"""

import asyncio
import hmac
import logging
import os
import socket
import sys
import tempfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from http import HTTPStatus
from importlib.metadata import version
from ipaddress import ip_address
from pathlib import Path
from typing import Any

from joblib import cpu_count

from imop.errors import InvalidInput
from imop.extras import extra
from imop.serving import schema, wire
from imop.serving.conversation import Conversation, Shared
from imop.serving.limits import Limits, WorkerEnded
from imop.serving.racing import race
from imop.serving.session import MakePolicy
from imop.serving.workers import Host
from imop.types import Demonstration

with extra("serve"):
    from websockets.asyncio.server import ServerConnection, serve
    from websockets.exceptions import ConnectionClosed
    from websockets.frames import CloseCode
    from websockets.http11 import Request, Response

HEALTH = "/healthz"
# A client that does not answer a ping for so long is gone, seconds; while it plans it may be slow to.
PATIENCE = 60.0

logger = logging.getLogger(__name__)
# It writes a traceback for every stranger who does not speak the protocol.
_of_protocol = logging.getLogger(f"{__name__}.protocol")
_of_protocol.setLevel(logging.CRITICAL)


class Server:
    """Serves a policy to several clients at once; each has an episode of its own.

    Args:
        make: makes a policy that has watched nothing; has to be picklable, as functions of modules are.
        demonstrations: what every session knows at first; a client may send others.
        host: address to listen at.
        port: to listen at; 0 takes a free one.
        key: that clients must have; needed for any address but loopback.
        limits: of a client.
        workers: requests that are worked on at once; by default as many as there are cores.
        metadata: what clients are told besides version and limits.

    Raises:
        InvalidInput: for an address other than loopback without a key, a port that is none, `workers` below
            1, or a system that cannot fork processes.
        MissingExtra: if the extra `serve` is not installed.
    """

    def __init__(
        self,
        make: MakePolicy,
        demonstrations: Sequence[Demonstration] = (),
        host: str = "127.0.0.1",
        port: int = 8000,
        key: str | None = None,
        limits: Limits | None = None,
        workers: int | None = None,
        metadata: dict[str, Any] | None = None,
    ):
        if not key and not is_loopback(host):
            problem = f"{host} can be reached by others, and there is no key"
            raise InvalidInput("host", problem, "127.0.0.1, or a key (IMOP_API_KEY for imop serve)")
        if not hasattr(os, "fork"):
            raise InvalidInput("platform", sys.platform, "Linux or macOS; clients run anywhere")
        if not 0 <= port < 2**16:
            raise InvalidInput("port", f"{port}", "0 .. 65535")
        workers = cpu_count() if workers is None else workers
        if workers < 1:
            raise InvalidInput("workers", f"{workers}", "a number from 1 on")
        self._make, self._demonstrations = make, [one.stripped() for one in demonstrations]
        self._address, self._key, self._limits = (host, port), key, limits or Limits()
        self._turn, self._stopping = asyncio.Semaphore(workers), asyncio.Event()
        self._metadata = wire.pack({**(metadata or {}), **self._description()})
        self._conversations: set[asyncio.Task[None]] = set()

    def stop(self) -> None:
        """Let what is worked on be finished and sent, then end; to be called in the thread of `run`.

        To end at once, cancel `run`.
        """
        self._stopping.set()

    async def run(self, started: Callable[[int], None] = lambda port: None) -> None:
        """Serve until `stop` is called.

        Args:
            started: is called with the port when clients can connect.

        Raises:
            InvalidInput: if the address cannot be listened at.
            ImopError: what the policy says against a demonstration.
            WorkerEnded: if the process that sessions come from ends.
        """
        # Bound before all that takes long; who connects is refused until somebody listens.
        with bound(*self._address) as address, tempfile.TemporaryDirectory(prefix="imop-") as folder:
            path = Path(folder) / "host"
            host = await Host.start(self._make, self._demonstrations, self._limits, path)
            shared = Shared(host, self._limits, self._turn, self._stopping, self._metadata)
            try:
                await self._listen(address, shared, started)
            finally:
                host.close()

    async def _listen(self, address: socket.socket, shared: Shared, started: Callable[[int], None]) -> None:
        server = await serve(
            lambda client: self._handle(client, shared),
            sock=address,
            process_request=self._admit,
            # A page in a browser says where it is from, and has no business here.
            origins=[None],
            compression=None,
            max_size=self._limits.message_bytes,
            max_queue=1,
            ping_timeout=PATIENCE,
            logger=_of_protocol,
        )
        async with server:
            started(address.getsockname()[1])
            ended, _ = await race(shared.host.ended(), self._stopping.wait())
            self._stopping.set()
            try:
                server.close(close_connections=False)
                await server.wait_closed()
            except asyncio.CancelledError:
                for conversation in self._conversations:
                    conversation.cancel()
                raise
        if not ended.cancelled():
            raise WorkerEnded("server", "start it again; if it was out of memory, with fewer sessions")

    def _description(self) -> dict[str, Any]:
        cameras = {name for one in self._demonstrations for name in one.keyframes[0].observation.views}
        return {
            "server": "imop",
            "version": version("imop"),
            "protocol": schema.PROTOCOL,
            "demonstrations": len(self._demonstrations),
            "cameras": sorted(cameras),
            "limits": vars(self._limits),
        }

    def _admit(self, client: ServerConnection, request: Request) -> Response | None:
        """Answer who only asks for health or may not connect; None lets in."""
        if request.path == HEALTH:
            return client.respond(HTTPStatus.OK, "OK\n")
        if self._key and not _has_key(request, self._key):
            problem = "wrong or missing key; accepted: the header Authorization: Api-Key KEY\n"
            return client.respond(HTTPStatus.UNAUTHORIZED, problem)
        if (sessions := len(self._conversations)) >= self._limits.sessions:
            problem = f"there are {sessions} sessions already; remedy: try again later\n"
            return client.respond(HTTPStatus.SERVICE_UNAVAILABLE, problem)
        return None

    async def _handle(self, client: ServerConnection, shared: Shared) -> None:
        task = asyncio.current_task()
        assert task is not None
        if len(self._conversations) >= self._limits.sessions:
            # Several were let in before the first of them was counted.
            await client.close(CloseCode.TRY_AGAIN_LATER, "too many sessions")
            return
        self._conversations.add(task)
        logger.info("%s came", client.remote_address)
        try:
            with suppress(ConnectionClosed):
                await Conversation(client, shared).hold()
        except Exception:
            logger.exception("%s", client.remote_address)
            raise
        finally:
            self._conversations.discard(task)
            logger.info("%s left", client.remote_address)


def is_loopback(host: str) -> bool:
    """Whether only programs on this machine can reach an address."""
    try:
        return host == "localhost" or ip_address(host).is_loopback
    except ValueError:
        return False


def bound(host: str, port: int) -> socket.socket:
    """A socket at an address, which does not listen yet.

    Raises:
        InvalidInput: if there is no such address, or its port is taken.
    """
    try:
        found = socket.getaddrinfo(host or None, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
        family, kind, protocol, _, address = found[0]
        made = socket.socket(family, kind, protocol)
        made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        made.bind(address)
    except OSError as error:
        problem = f"cannot listen at {host}:{port} ({error})"
        raise InvalidInput("port", problem, "an address of this machine, and a port that is free") from error
    return made


def _has_key(request: Request, key: str) -> bool:
    given = request.headers.get_all("Authorization")
    return len(given) == 1 and hmac.compare_digest(given[0].encode(), f"Api-Key {key}".encode())
