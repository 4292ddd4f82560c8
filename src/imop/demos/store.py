"""Demonstrations in a Zarr v3 store: one group per episode, written once, never changed.

An episode is written under a hidden name and renamed when it is complete, so a writer that dies at any
moment leaves nothing half-visible, and several processes may append to one store.
"""

import os
import re
import shutil
import socket
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast

import numpy as np
import zarr
from numpy.typing import NDArray
from zarr.codecs import BloscCodec, Crc32cCodec

from imop.demos import episode
from imop.errors import CorruptData, InvalidInput
from imop.types import Demonstration

FORMAT = "imop demonstrations"
VERSION = 2
READABLE = (1, 2)
"""Version 2 has checksums of attributes and of compressed data, which version 1 may lack."""

_EPISODE = re.compile(r"episode_(\d{6,})$")
_UNFINISHED = re.compile(r"\.writing-(?P<host>.+)-(?P<pid>\d+)-[0-9a-f]+$")


class DemonstrationStore:
    """A growing sequence of demonstrations on disk.

    Make one with `create` or `open`. A store at an fsspec URL can be read, not appended to.
    """

    def __init__(self, path: Path | str, group: zarr.Group):
        self.path, self._group = path, group

    @classmethod
    def create(cls, path: Path | str) -> "DemonstrationStore":
        """Make an empty store in a folder that does not exist or is empty.

        Raises:
            InvalidInput: if there is something already, or `path` is a URL.
        """
        folder = _local(path)
        if folder is None:
            raise InvalidInput("path", f"{path} is a URL", "a local folder; copy the finished store")
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise InvalidInput("path", f"{folder} already exists", "a new or empty folder")
        zarr.create_group(folder, attributes={"format": FORMAT, "version": VERSION})
        return cls.open(folder)

    @classmethod
    def open(cls, path: Path | str, verify: bool = True) -> "DemonstrationStore":
        """Open a store; checks its version.

        Args:
            path: folder or URL.
            verify: also check all episodes: that none is missing, attributes, shapes of the arrays. Otherwise
                what is wrong with one is found when it is read.

        Raises:
            InvalidInput: if there is no store at `path`.
            CorruptData: if it was written by a later version, or is not complete.
        """
        accepted = "the path of a store of demonstrations (imop collect and imop import make them)"
        try:
            group = zarr.open_group(_location(path), mode="r")
        except (FileNotFoundError, NotADirectoryError, zarr.errors.NodeNotFoundError):
            raise InvalidInput("path", f"there is no store at {path}", accepted) from None
        except Exception as error:  # damaged JSON, unknown URL schemes, permissions, networks
            raise CorruptData(path, f"the store cannot be opened ({error})") from error
        if group.attrs.get("format") != FORMAT:
            raise InvalidInput("path", f"the Zarr group at {path} holds no demonstrations", accepted)
        if group.attrs.get("version") not in READABLE:
            problem = f"format version {group.attrs.get('version')}, but this imop reads {READABLE}"
            raise CorruptData(path, problem, "install the imop that wrote it")
        store = cls(path, group)
        for index in range(len(store) if verify else 0):
            store._verified(index)
        return store

    def __len__(self) -> int:
        return len(self._names())

    def __iter__(self) -> Iterator[Demonstration]:
        return (self[index] for index in range(len(self)))

    def __getitem__(self, index: int) -> Demonstration:
        """The demonstration appended as number `index`; negative numbers count from the end.

        Raises:
            IndexError: if there are not so many.
            CorruptData: if it cannot be read back as it was written.
        """
        n = len(self)
        if not -n <= index < n:
            raise IndexError(f"episode {index} of a store of {n}")
        where = f"{self.path}/{_name(index % n)}"
        attributes, arrays = self._verified(index % n)
        declared = attributes["arrays"]
        stacked = {name: _read(f"{where}/{name}", a, declared[name]["crc32"]) for name, a in arrays.items()}
        try:
            return episode.unpack(attributes, stacked)
        except Exception as error:  # version 1 has no digest, so attributes can be anything
            raise CorruptData(where, f"the parts do not fit together ({error!r})") from error

    def digest(self, index: int) -> str:
        """The digest of episode `index`, see `imop.demos.episode.digest`, without its images.

        Raises:
            CorruptData: if the description of the episode is damaged.
        """
        return episode.digest(self._verified(index)[0])

    def digests(self) -> set[str]:
        """The digests of all episodes.

        Raises:
            CorruptData: if the description of an episode is damaged.
        """
        return {self.digest(index) for index in range(len(self))}

    def aims(self) -> list[tuple[str, int, int]]:
        """Task, variation, and seed of the objects (-1 if it is not known) of every episode, without images.

        Raises:
            CorruptData: if the description of an episode is damaged.
        """
        described = (self._verified(index)[0] for index in range(len(self)))
        return [(d["task"], d["variation"], d["seeds"].get("instance", -1)) for d in described]

    def append(self, demonstration: Demonstration) -> int:
        """Write `demonstration` behind the others; also removes what writers that died have left.

        Returns:
            The number of the new episode.

        Raises:
            InvalidInput: if the store is at a URL, or the demonstration holds predicted actions.
        """
        folder = _local(self.path)
        if folder is None:
            raise InvalidInput("path", f"{self.path} is a URL", "a local store; copy it when it is finished")
        attributes, arrays = episode.pack(demonstration)
        _remove_leftovers(folder)
        unfinished = folder / f".writing-{socket.gethostname()}-{os.getpid()}-{uuid.uuid4().hex}"
        try:
            _write(unfinished, attributes, arrays)
            return _publish(unfinished, folder, len(self))
        except BaseException:
            shutil.rmtree(unfinished, ignore_errors=True)
            raise

    def _names(self) -> list[str]:
        folder = _local(self.path)
        names = [p.name for p in folder.iterdir()] if folder else list(self._group.group_keys())
        found = sorted((int(match[1]), name) for name in names if (match := _EPISODE.match(name)))
        for expected, (number, _) in enumerate(found):
            if number != expected:
                remedy = "restore it, or rename the later ones so that none is missing"
                raise CorruptData(self.path, f"episode_{expected:06d} is missing", remedy)
        return [name for _, name in found]

    def _verified(self, index: int) -> "tuple[episode.Attributes, dict[str, zarr.Array[Any]]]":
        """The episode's attributes and arrays, if all but the content of the arrays is what was written."""
        where = f"{self.path}/{_name(index)}"
        try:
            group = zarr.open_group(self._group.store, path=_name(index), mode="r")
            attributes: episode.Attributes = dict(group.attrs)
            declared = dict(attributes["arrays"])
        except Exception as error:  # damaged JSON fails in many ways
            raise CorruptData(where, f"the episode's description is unreadable ({error!r})") from error
        has_digest = "digest" in attributes or self._group.attrs["version"] != 1
        if has_digest and attributes.get("digest") != episode.digest(attributes):
            raise CorruptData(where, "the episode's description is not what was written (the digest differs)")
        arrays = {name: _described(group, f"{where}/{name}", name, declared[name]) for name in declared}
        return attributes, arrays


def _described(group: zarr.Group, where: str, name: str, declared: Any) -> "zarr.Array[Any]":
    """The array `name`, if it has the shape and type that it was written with."""
    try:
        array = cast("zarr.Array[Any]", group[name])
        actual = {"shape": list(array.shape), "dtype": array.dtype.name}
        wanted = {key: declared[key] for key in actual}
        crc32, blocks = declared["crc32"], (array.chunks, array.shards or array.chunks)
    except Exception as error:  # as above
        raise CorruptData(where, f"the array's description is missing or unreadable ({error!r})") from error
    if actual != wanted or not isinstance(crc32, int):
        raise CorruptData(where, f"is {actual}, was written as {declared}")
    # Zarr makes room for a whole block before it reads one.
    if any(not 0 <= n <= max(m, 1) for block in blocks for n, m in zip(block, array.shape, strict=True)):
        raise CorruptData(where, f"has blocks {blocks}, larger than its shape {array.shape}")
    return array


def _read(where: str, array: "zarr.Array[Any]", checksum: int) -> NDArray[Any]:
    try:
        content = np.asarray(array[...])
    except Exception as error:  # each codec has its own ways to say that bytes are missing or wrong
        raise CorruptData(where, f"the data cannot be read ({error})") from error
    # Not left to the codecs: Zarr reads a missing or empty file as zeros.
    if episode.checksum(content) != checksum:
        raise CorruptData(where, "the data are not what was written (the checksum differs)")
    return content


def _name(index: int) -> str:
    return f"episode_{index:06d}"


def _local(path: Path | str) -> Path | None:
    """The folder, or None if `path` is a URL."""
    return None if "://" in str(path) else Path(path)


def _location(path: Path | str) -> Path | str:
    return _local(path) or str(path)


def _write(folder: Path, attributes: episode.Attributes, arrays: episode.Arrays) -> None:
    group = zarr.create_group(folder, attributes=attributes)
    for name, array in arrays.items():
        is_image = array.nbytes > 2**16
        group.create_array(
            name,
            data=array,
            # One image can be read without the others, and yet they are one file. No chunk may be empty.
            chunks=(1, *array.shape[1:]) if is_image else tuple(max(side, 1) for side in array.shape),
            shards=array.shape if is_image else None,
            chunk_key_encoding={"name": "default", "separator": "."},
            # Blosc crashes on some damaged input, so that what it gets has a checksum.
            compressors=[BloscCodec(cname="zstd", clevel=5, shuffle="shuffle"), Crc32cCodec()],
        )
    for file in folder.rglob("*"):
        if file.is_file():
            with file.open("rb") as stream:
                os.fsync(stream.fileno())


def _publish(unfinished: Path, folder: Path, index: int) -> int:
    """Give the finished episode the next free number, also if other processes append at the same time."""
    while True:
        target = folder / _name(index)
        try:
            os.rename(unfinished, target)
            return index
        except OSError:
            if not target.exists():
                raise
            index += 1


def _remove_leftovers(folder: Path) -> None:
    for path in folder.iterdir():
        match = _UNFINISHED.match(path.name)
        if match and match["host"] == socket.gethostname() and not _alive(int(match["pid"])):
            shutil.rmtree(path, ignore_errors=True)


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True
