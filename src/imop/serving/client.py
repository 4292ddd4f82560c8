"""A client that needs numpy, msgpack and websockets, and neither torch nor a simulator."""

import re
from collections.abc import Sequence
from contextlib import suppress
from types import TracebackType
from typing import TYPE_CHECKING, Any, NoReturn

from imop.errors import ImopError, InvalidInput, NoConfidentMatch
from imop.extras import extra
from imop.serving import schema, wire
from imop.types import Action, Demonstration, Observation

if TYPE_CHECKING:
    from imop.geometry.focus import Focus

with extra("serve"):
    from websockets.exceptions import ConnectionClosed, InvalidStatus, WebSocketException
    from websockets.sync.client import connect


class ServerError(ImopError):
    """The server refused or failed; `kind` is the name of its error, `text` all that it said."""

    def __init__(self, kind: str, problem: str, text: str = ""):
        self.kind, self.problem, self.text = kind, problem, text
        super().__init__(f"server: {kind}: {problem}")


class Client:
    """A policy that runs on a server: watch, reset, act, as `OneShotPolicy` has them.

    A client has one episode at a time and is used by one thread. After an error other than
    `NoConfidentMatch` the server has closed the connection, and with it the episode.

    Args:
        host: name or address, or a URL that begins with ws:// or wss://.
        port: of the server; None for that of the URL.
        key: that the server asks for.

    Raises:
        ServerError: if there is no server, it refuses, or speaks another version.
        MissingExtra: if the extra `serve` is not installed.
    """

    def __init__(self, host: str = "127.0.0.1", port: int | None = 8000, key: str | None = None):
        uri = host if host.startswith(("ws://", "wss://")) else f"ws://{host}"
        headers = {"Authorization": f"Api-Key {key}"} if key else None
        try:
            # Left again by `close`. What stands beside a robot is not reached through a proxy.
            self._socket = connect(
                uri if port is None else f"{uri}:{port}",
                additional_headers=headers,
                compression=None,
                max_size=None,
                proxy=None,
            ).__enter__()
        except InvalidStatus as error:
            said = (error.response.body or b"").decode(errors="replace").strip()
            raise ServerError(f"HTTP {error.response.status_code}", said) from error
        except (OSError, WebSocketException) as error:
            raise ServerError(type(error).__name__, f"{error}") from error
        self.metadata = self._metadata()
        """What the server said of itself: version, protocol, method, demonstrations, cameras, limits."""
        self.timing: dict[str, float] = {}
        """Milliseconds of the last request: infer_ms, wait_ms and, of the one before, prev_total_ms."""
        self._shown: list[Demonstration] = []
        self._unsent: Sequence[Demonstration] = ()
        self._reset = True

    def watch(self, demonstration: Demonstration) -> None:
        """Show a demonstration instead of what the server has preloaded; a further call adds another one.

        It is sent with the next observation, which begins an episode.
        """
        self._shown.append(demonstration)
        self._unsent = self._shown

    def reset(self) -> None:
        """Begin a new episode, with the next observation."""
        self._reset = True

    def act(self, observation: Observation, focus: "Focus | None" = None) -> Action:
        """The action for what is seen now.

        Args:
            observation: what is seen.
            focus: which thing is meant, if a person, a detector or a click says so.

        Raises:
            InvalidInput: if the server says that the observation or a demonstration is not as it should be.
            NoConfidentMatch: if the confidence is below what the server asks for; the episode goes on.
            ServerError: if the server failed, took too long, or is gone.
        """
        fields = {**schema.observation_fields(observation), "reset": self._reset}
        if self._unsent:
            fields["demonstrations"] = [schema.demonstration_fields(one) for one in self._unsent]
        if focus is not None:
            fields["focus"] = schema.focus_fields(focus)
        # Whatever comes back, the server has heard this, or there is nobody to hear it a second time.
        self._reset, self._unsent = False, ()
        reply = self._ask(fields)
        self.timing = reply.get("server_timing", {})
        return schema.to_action(reply)

    def close(self) -> None:
        """Leave; the server forgets the episode."""
        self._socket.close()

    def __enter__(self) -> "Client":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _metadata(self) -> dict[str, Any]:
        metadata = self._receive()
        found = metadata.get("server"), metadata.get("protocol")
        if found != ("imop", schema.PROTOCOL):
            self.close()
            raise ServerError("version", f"speaks {found}; accepted: ('imop', {schema.PROTOCOL})")
        return metadata

    def _ask(self, fields: schema.Fields) -> dict[str, Any]:
        # What the server said before it closed may still be there to read.
        with suppress(ConnectionClosed):
            self._socket.send(wire.pack(fields))
        return self._receive()

    def _receive(self) -> dict[str, Any]:
        try:
            reply = self._socket.recv()
        except ConnectionClosed as error:
            reason = error.rcvd.reason if error.rcvd else "without a word"
            raise ServerError(
                "closed", f"the connection is closed ({reason}); remedy: make a new Client"
            ) from error
        if isinstance(reply, str):
            _raise(reply)
        fields = wire.unpack(reply)
        if not isinstance(fields, dict):
            raise ServerError("reply", f"is a {type(fields).__name__}; accepted: a map")
        return fields


_INVALID = re.compile(r"(?P<field>.*?): (?P<problem>.*); accepted: (?P<accepted>.*)")
_UNSURE = re.compile(r"confidence: (?P<confidence>[\d.]+) is below the required (?P<required>[\d.]+)")


def _raise(text: str) -> NoReturn:
    """The error whose traceback the server sent."""
    kind, _, problem = text.strip().rpartition("\n")[2].partition(": ")
    name = kind.rpartition(".")[2]
    if name == "InvalidInput" and (invalid := _INVALID.fullmatch(problem)):
        raise InvalidInput(**invalid.groupdict())
    if name == "NoConfidentMatch" and (unsure := _UNSURE.fullmatch(problem)):
        raise NoConfidentMatch(*map(float, unsure.groups()))
    raise ServerError(name, problem, text)
