"""The file around a model: a header of 1021 bytes, then the body, packed or not."""

from dataclasses import dataclass

from imop.errors import ModelFormatError
from imop.tasks.coppelia import huffman

HEADER_SIZE = 1021
VERSIONS = range(18, 26)
LARGEST_FILE = 1 << 25
LARGEST_BODY = 1 << 26
"""Bytes. RLBench's largest file has 3.4 MB."""


@dataclass(frozen=True)
class Header:
    """What the header says.

    Attributes:
        version: of the serialisation.
        packed: whether the body is Huffman coded.
        size: bytes of the body when unpacked.
    """

    version: int
    packed: bool
    size: int


def read_header(data: bytes) -> Header:
    """The header of a file.

    Raises:
        ModelFormatError: if it is not a model that we can read.
    """
    if len(data) < HEADER_SIZE:
        raise ModelFormatError(len(data), "the file ends in its header", f"{HEADER_SIZE} bytes")
    if len(data) > LARGEST_FILE:
        raise ModelFormatError(LARGEST_FILE, "a huge file", f"at most {LARGEST_FILE} bytes")
    if data[:4] != b"VREP":
        raise ModelFormatError(0, f"{data[:4]!r}", "a .ttm file, which begins with VREP")
    version, size = (int.from_bytes(data[i : i + 4], "little", signed=True) for i in (4, 13))
    if version not in VERSIONS:
        raise ModelFormatError(4, f"serialisation version {version}", f"{VERSIONS[0]} .. {VERSIONS[-1]}")
    if data[12] not in (0, 1):
        raise ModelFormatError(12, f"compression {data[12]}", "0 (none) or 1 (Huffman)")
    if not 0 <= size <= LARGEST_BODY:
        raise ModelFormatError(13, f"a body of {size} bytes", f"0 .. {LARGEST_BODY}")
    return Header(version, data[12] == 1, size)


def unpack(data: bytes) -> bytes:
    """The body of a file, unpacked.

    Raises:
        ModelFormatError: if header or codes are broken; offsets are the file's here.
    """
    header = read_header(data)
    if header.packed:
        return huffman.decode(data, HEADER_SIZE, header.size)
    body = data[HEADER_SIZE:]
    if len(body) != header.size:
        raise ModelFormatError(13, f"a body of {len(body)} bytes", f"{header.size} bytes as announced")
    return body
