"""Servers in a thread, and clients that speak the protocol by hand."""

import asyncio
import threading
from contextlib import contextmanager

from websockets.sync.client import connect

from imop.serving import Server, wire
from imop.serving.schema import observation_fields
from tests.serving.policies import Remembering, observe


class Running:
    """A server that runs; `stop` waits until it has ended."""

    def __init__(self, make, demonstrations, options):
        self._ready, self.failure, self.port = threading.Event(), None, None
        self._thread = threading.Thread(target=self._run, args=(make, demonstrations, options))
        self._thread.start()
        self._ready.wait()
        if self.failure is not None:
            self._thread.join()
            raise self.failure

    def _run(self, make, demonstrations, options):
        async def run():
            self._server = Server(make, demonstrations, port=0, **options)
            self._loop = asyncio.get_running_loop()
            await self._server.run(started)

        def started(port):
            self.port = port
            self._ready.set()

        try:
            asyncio.run(run())
        except Exception as error:
            self.failure = error
            self._ready.set()

    def stop(self):
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._server.stop)
        self._thread.join()

    def connect(self, **options):
        uri = f"ws://127.0.0.1:{self.port}"
        return connect(uri, compression=None, max_size=None, close_timeout=0.1, **options)

    @contextmanager
    def join(self):
        """A raw connection that has read the metadata."""
        with self.connect() as socket:
            socket.recv()
            yield socket


@contextmanager
def serving(make=Remembering, demonstrations=(), **options):
    running = Running(make, demonstrations, options)
    try:
        yield running
    finally:
        running.stop()


def message(opening=0.5, time_step=0, **more):
    return wire.pack({**observation_fields(observe(opening, time_step)), **more})


def ask(socket, *args, **more):
    """The reply to an observation, or the text of an error."""
    socket.send(message(*args, **more))
    reply = socket.recv()
    return reply if isinstance(reply, str) else wire.unpack(reply)


def ask_once(server, *args, **more):
    """As `ask`, of a client that leaves then."""
    with server.join() as socket:
        return ask(socket, *args, **more)


def place(reply):
    """Where it goes: sum of openings, actions, demonstrations."""
    return reply["T_world_gripper"][:3, 3].tolist()
