"""Checks recorded demonstrations before they are learned from: what is wrong, where, and how to mend it."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

from imop.demos.check_rlbench import check_episode
from imop.demos.check_steps import TipPose, check_demonstration
from imop.demos.findings import Finding
from imop.demos.rlbench import POLICY_CAMERAS, episodes
from imop.demos.store import DemonstrationStore
from imop.errors import CorruptData

Track = Callable[[Sequence[int]], Iterable[int]]


def check(
    path: Path | str,
    cameras: Sequence[str] = POLICY_CAMERAS,
    tip_pose: TipPose | None = None,
    track: Track = iter,
) -> list[Finding]:
    """Everything that looks wrong in a store of demonstrations, or in a folder in RLBench's layout.

    Args:
        path: a store, or anything that `imop.demos.rlbench.episodes` accepts.
        cameras: which cameras a folder of RLBench should contain; a store says so itself.
        tip_pose: forward kinematics of the robot, (7,) joint positions -> (4, 4) T_world_gripper; without it
            gripper poses are not compared with joint positions.
        track: wraps the episode numbers, to show progress.

    Returns:
        The findings in the order of the episodes; empty if nothing is wrong.

    Raises:
        InvalidInput: if there is neither a store nor an episode at `path`.
    """
    if (Path(path) / "zarr.json").exists() or "://" in str(path):
        return list(_check_store(path, tip_pose, track))
    folders = episodes(path)
    return [f for i in track(range(len(folders))) for f in check_episode(folders[i], cameras, tip_pose)]


def _check_store(path: Path | str, tip_pose: TipPose | None, track: Track) -> Iterator[Finding]:
    try:
        store = DemonstrationStore.open(path)
        if not len(store):
            yield Finding("error", str(path), "the store is empty", "record or import demonstrations into it")
        for index in track(range(len(store))):
            yield from _check_stored(store, index, tip_pose)
    except CorruptData as error:
        yield _finding(error)


def _check_stored(store: DemonstrationStore, index: int, tip_pose: TipPose | None) -> Iterator[Finding]:
    try:
        demonstration = store[index]
    except CorruptData as error:
        yield _finding(error)
    else:
        yield from check_demonstration(demonstration, f"{store.path}/episode_{index:06d}", tip_pose)


def _finding(error: CorruptData) -> Finding:
    return Finding("error", str(error.path), error.problem, error.remedy)
