"""A policy behind a socket: openpi's websocket protocol, with imop's observations and actions.

The public names stand in __init__.pyi; each is imported when it is first used, so that a client waits for
numpy, msgpack and websockets only.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
