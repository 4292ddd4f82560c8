"""Runs where the published client is installed: observations from standard input, replies to standard output.

Each is one msgpack message after its length in 8 bytes. The first to be written are the metadata.
"""

import struct
import sys

from openpi_client import msgpack_numpy
from openpi_client.websocket_client_policy import WebsocketClientPolicy

LENGTH = struct.Struct("!Q")


def write(value):
    message = msgpack_numpy.packb(value)
    sys.stdout.buffer.write(LENGTH.pack(len(message)) + message)
    sys.stdout.buffer.flush()


policy = WebsocketClientPolicy("127.0.0.1", int(sys.argv[1]), api_key=sys.argv[2])
write(policy.get_server_metadata())
while head := sys.stdin.buffer.read(LENGTH.size):
    observation = msgpack_numpy.unpackb(sys.stdin.buffer.read(LENGTH.unpack(head)[0]))
    try:
        write(policy.infer(observation))
    except RuntimeError as error:
        write({"error": str(error)})
