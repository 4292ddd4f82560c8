"""Every session has a process of its own, so that it can be ended without harm to the others.

A host process loads the policy and shows it the demonstrations once. Whoever connects to its socket gets a
fork of it: it begins at once, in the same state as every other, and shares the host's memory until it writes
to it. Python's lock, a crash, a leak or an endless loop in one session are nothing to another one, and a
session that is over gives everything back.
"""

import asyncio
import gc
import multiprocessing
import os
import signal
import socket
import struct
import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import NoReturn

from imop.errors import ImopError
from imop.serving.limits import Limits, WorkerEnded
from imop.serving.session import MakePolicy, Outcome, Reply, Session
from imop.types import Demonstration

# Of a request: its length, how long it waited for its turn, and how long the request before took, ms.
_REQUEST = struct.Struct("!Qdd")
# Of a reply: its outcome and length.
_REPLY = struct.Struct("!BQ")
_PID = struct.Struct("!q")
_THREADS = "OMP_NUM_THREADS"


class Worker:
    """The process of one session, as the server sees it."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, pid: int):
        self._reader, self._writer, self._pid = reader, writer, pid

    async def ask(self, message: bytes, wait_ms: float, prev_total_ms: float) -> Reply:
        """The reply to a message.

        Raises:
            WorkerEnded: if the process ended meanwhile.
        """
        try:
            self._writer.write(_REQUEST.pack(len(message), wait_ms, prev_total_ms))
            self._writer.write(message)
            await self._writer.drain()
            outcome, length = _REPLY.unpack(await self._reader.readexactly(_REPLY.size))
            return Reply(Outcome(outcome), await self._reader.readexactly(length))
        except (OSError, asyncio.IncompleteReadError) as error:
            raise WorkerEnded from error

    def end(self) -> None:
        """End the process, whatever it is doing."""
        # If it has ended by itself, another process may have its number.
        if not self._reader.at_eof():
            with suppress(ProcessLookupError):
                os.kill(self._pid, signal.SIGKILL)
        self._writer.transport.abort()


class Host:
    """The process that sessions are forked from; made by `start`."""

    def __init__(self, process: BaseProcess, pipe: "Connection[None, Exception | None]", path: Path):
        self._process, self._pipe, self._path = process, pipe, path

    @classmethod
    async def start(
        cls, make: MakePolicy, demonstrations: Sequence[Demonstration], limits: Limits, path: Path
    ) -> "Host":
        """A host whose policy has watched the demonstrations.

        Args:
            make: makes a policy that has watched nothing; is pickled.
            demonstrations: what every session knows at first.
            limits: of a session.
            path: of the socket, in a folder that nobody else may enter.

        Raises:
            ImopError: what the policy says against a demonstration.
            WorkerEnded: if the process ended before it was ready.
        """
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        arguments = make, demonstrations, limits, path, theirs
        process = context.Process(target=_host, args=arguments, name="imop-host")
        with _one_thread():
            process.start()
        theirs.close()
        host = cls(process, ours, path)
        try:
            await _readable(ours)
            failure = ours.recv()
        except BaseException as error:
            host.close()
            if isinstance(error, EOFError):
                remedy = "read what it printed; scripts need the line `if __name__ == '__main__':`"
                raise WorkerEnded("server", remedy) from error
            raise
        if failure is not None:
            host.close()
            raise failure
        return host

    async def ended(self) -> None:
        """Wait until the process has ended, which it should not."""
        await _readable(self._pipe)

    async def session(self) -> Worker:
        """A new session.

        Raises:
            WorkerEnded: if the host is gone, or can start no process.
        """
        try:
            reader, writer = await asyncio.open_unix_connection(self._path)
        except OSError as error:
            raise WorkerEnded from error
        try:
            (pid,) = _PID.unpack(await reader.readexactly(_PID.size))
        except BaseException as error:
            writer.transport.abort()
            if isinstance(error, OSError | asyncio.IncompleteReadError):
                raise WorkerEnded from error
            raise
        return Worker(reader, writer, pid)

    def close(self) -> None:
        """End the host; sessions that were begun go on."""
        self._process.kill()
        self._process.join()
        self._process.close()
        self._pipe.close()


async def _readable(pipe: "Connection[None, Exception | None]") -> None:
    loop = asyncio.get_running_loop()
    ready = loop.create_future()

    def found() -> None:
        if not ready.done():
            ready.set_result(None)

    loop.add_reader(pipe.fileno(), found)
    try:
        await ready
    finally:
        loop.remove_reader(pipe.fileno())


@contextmanager
def _one_thread() -> Iterator[None]:
    """Processes that are started in here do without threads of OpenMP: these do not survive a fork.

    Several sessions make better use of the cores than several threads of one.
    """
    before = os.environ.get(_THREADS)
    os.environ[_THREADS] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ[_THREADS]
        else:
            os.environ[_THREADS] = before


def _host(
    make: MakePolicy,
    demonstrations: Sequence[Demonstration],
    limits: Limits,
    path: Path,
    server: "Connection[Exception | None, None]",
) -> None:
    # Ctrl-C and a service manager tell all processes at once; only the server may decide to end a step.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
    try:
        policy = make()
        for demonstration in demonstrations:
            policy.watch(demonstration)
    except Exception as error:
        # Not every error can be sent to another process.
        server.send(error if isinstance(error, ImopError) else RuntimeError(traceback.format_exc()))
        return
    session = Session(make, policy, len(demonstrations), limits)
    # What is there now stays in use: sessions that look for garbage leave it alone, and so do not copy it.
    gc.collect()
    gc.freeze()
    # The kernel clears away sessions that are over.
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(path))
        listener.listen(limits.sessions)
        server.send(None)
        # The pipe is at its end when the server is gone, however it ended.
        while server not in wait([listener, server]):
            connection, _ = listener.accept()
            with connection:
                if _forked():
                    # Nobody shall take this process for the host when that is gone.
                    listener.close()
                    server.close()
                    _be_session(connection, session, limits)


def _forked() -> bool:
    """Whether this is a new process; where none can be had, the server finds the connection closed."""
    try:
        return os.fork() == 0
    except OSError:
        traceback.print_exc()
        return False


def _be_session(connection: socket.socket, session: Session, limits: Limits) -> NoReturn:
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    try:
        _limit_memory(limits.session_bytes)
        _serve(connection, session)
    except ConnectionError:
        pass  # the server has left
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(0)


def _serve(connection: socket.socket, session: Session) -> None:
    """Answer until the server leaves."""
    connection.sendall(_PID.pack(os.getpid()))
    while (head := _receive(connection, _REQUEST.size)) is not None:
        length, wait_ms, prev_total_ms = _REQUEST.unpack(head)
        if (message := _receive(connection, length)) is None:
            return
        timing = {"wait_ms": wait_ms} | ({"prev_total_ms": prev_total_ms} if prev_total_ms else {})
        reply = session.reply(message, timing)
        del message
        connection.sendall(_REPLY.pack(reply.outcome.value, len(reply.content)))
        connection.sendall(reply.content)


def _limit_memory(more: int) -> None:
    """Let this process take so many bytes more than it has now, where the system can tell."""
    import resource  # only where processes can be forked

    statm = Path("/proc/self/statm")
    if statm.exists():
        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        most = int(statm.read_text().split()[0]) * resource.getpagesize() + more
        resource.setrlimit(resource.RLIMIT_AS, (most if hard < 0 else min(most, hard), hard))


def _receive(connection: socket.socket, length: int) -> bytearray | None:
    """So many bytes, or None if the other side has left."""
    received = bytearray(length)
    rest = memoryview(received)
    while rest:
        if not (count := connection.recv_into(rest)):
            return None
        rest = rest[count:]
    return received
