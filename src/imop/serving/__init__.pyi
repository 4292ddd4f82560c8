from .client import Client, ServerError
from .limits import Limits
from .server import Server

__all__ = ["Client", "Limits", "Server", "ServerError"]
