"""Frames of ROS: what was told of each and its parent over time, and the way from one to another."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from imop.geometry import se3
from imop.types import FloatArray


@dataclass(eq=False)
class _Edge:
    """What was told of one frame: its parent, and where it is there."""

    parent: str
    static: bool
    told: dict[float, FloatArray] = field(default_factory=dict)


class TransformTree:
    """All transforms of a recording. Between two stamps a frame is where one would expect it."""

    def __init__(self) -> None:
        self._edges: dict[str, _Edge] = {}
        self._tracks: dict[str, tuple[FloatArray, FloatArray, Slerp | None]] = {}

    def add(self, parent: str, child: str, stamp: float, T_parent_child: FloatArray, static: bool) -> None:
        """Tell where a frame is in another one, (4, 4)."""
        parent, child = parent.lstrip("/"), child.lstrip("/")
        edge = self._edges.setdefault(child, _Edge(parent, static))
        edge.static = edge.static and static
        edge.told[stamp] = T_parent_child
        self._tracks.pop(child, None)

    @property
    def frames(self) -> list[str]:
        """Names of all frames, sorted."""
        return sorted({*self._edges, *(edge.parent for edge in self._edges.values())})

    @property
    def roots(self) -> list[str]:
        """Names of the frames that have no parent."""
        return [frame for frame in self.frames if frame not in self._edges]

    def connects(self, a: str, b: str) -> bool:
        """Whether there is a way between two frames."""
        return self._ancestors(a)[-1] == self._ancestors(b)[-1]

    def moves(self, a: str, b: str) -> bool:
        """Whether b was told to move in the frame of a."""
        up, down = self._way(a, b)
        return any(not self._edges[frame].static for frame in (*up, *down))

    def lookup(self, a: str, b: str, stamps: FloatArray) -> FloatArray:
        """(n, 4, 4) T_a_b at stamps (n,); outside of what was told, the nearest that was."""
        up, down = self._way(a, b)
        T = np.tile(np.eye(4), (len(stamps), 1, 1))
        for frame in up:
            T = T @ se3.invert(self._at(frame, stamps))
        for frame in reversed(down):
            T = T @ self._at(frame, stamps)
        return T

    def span(self, a: str, b: str) -> tuple[float, float]:
        """First and last stamp between which all of the way is known; without end if nothing moves."""
        up, down = self._way(a, b)
        dynamic = [self._edges[frame].told for frame in (*up, *down) if not self._edges[frame].static]
        return max((min(told) for told in dynamic), default=-np.inf), min(
            (max(told) for told in dynamic), default=np.inf
        )

    def _way(self, a: str, b: str) -> tuple[list[str], list[str]]:
        """Frames whose edges lead from a up to the frame that both are under, and from b up to it."""
        over_a, over_b = self._ancestors(a), self._ancestors(b)
        common = next(frame for frame in over_a if frame in over_b)
        return over_a[: over_a.index(common)], over_b[: over_b.index(common)]

    def _ancestors(self, frame: str) -> list[str]:
        found = [frame.lstrip("/")]
        while (edge := self._edges.get(found[-1])) is not None and edge.parent not in found:
            found.append(edge.parent)
        return found

    def _at(self, frame: str, stamps: FloatArray) -> FloatArray:
        if frame not in self._tracks:
            self._tracks[frame] = _track(self._edges[frame].told.items())
        times, poses, slerp = self._tracks[frame]
        if slerp is None:
            return np.broadcast_to(poses[-1], (len(stamps), 4, 4))
        at = np.clip(stamps, times[0], times[-1])
        T = np.tile(np.eye(4), (len(at), 1, 1))
        T[:, :3, :3] = slerp(at).as_matrix()
        T[:, :3, 3] = np.stack([np.interp(at, times, poses[:, i, 3]) for i in range(3)], axis=1)
        return T


def _track(told: Iterable[tuple[float, FloatArray]]) -> tuple[FloatArray, FloatArray, Slerp | None]:
    ordered = sorted(told, key=lambda one: one[0])
    times, poses = np.array([stamp for stamp, _ in ordered]), np.array([T for _, T in ordered])
    several = len(times) > 1
    return times, poses, Slerp(times, Rotation.from_matrix(poses[:, :3, :3])) if several else None
