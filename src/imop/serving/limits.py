"""What a server gives to one client at most."""

from dataclasses import dataclass

from imop.errors import ImopError, InvalidInput


@dataclass(frozen=True)
class Limits:
    """Bounds of a server; what goes beyond is refused and named.

    Attributes:
        sessions: clients that are connected at once.
        message_bytes: size of one message.
        points: pixels of all views of one observation.
        keyframes: steps of all demonstrations that one message brings.
        request_seconds: time to work on one request, without waiting for its turn; then its worker is ended.
        idle_seconds: time until a message has arrived whole, and until a reply was taken.
        session_bytes: memory that a session may take beyond what all share.
    """

    sessions: int = 16
    message_bytes: int = 128 * 2**20
    points: int = 4_000_000
    keyframes: int = 200
    request_seconds: float = 300.0
    idle_seconds: float = 900.0
    session_bytes: int = 4 * 2**30

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not value > 0:
                raise InvalidInput(name, f"{value}", "a number above 0")


class TimeLimitExceeded(ImopError):
    """A request took longer than the server allows; its session is ended."""

    def __init__(self, seconds: float):
        self.seconds = seconds
        remedy = "send smaller images or fewer demonstrations, or start the server with a higher limit"
        super().__init__(f"request: took more than {seconds:g} s, the session is ended; remedy: {remedy}")


class WorkerEnded(ImopError):
    """A process is gone: that of a session, which is ended with it, or the one that sessions come from."""

    def __init__(self, what: str = "request", remedy: str = "connect again"):
        self.what, self.remedy = what, remedy
        super().__init__(f"{what}: the process that worked on it ended; remedy: {remedy}")
