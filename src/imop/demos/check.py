"""Checks recorded demonstrations before they are learned from: what is wrong, where, and how to mend it."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

from imop.demos.check_rlbench import check_episode
from imop.demos.check_steps import TipPose, check_demonstration
from imop.demos.findings import Finding
from imop.demos.rlbench import POLICY_CAMERAS, check_names, episodes, recorded_cameras
from imop.demos.store import DemonstrationStore
from imop.errors import CorruptData, ImopError

Track = Callable[[Sequence[int]], Iterable[int]]


def check(
    path: Path | str,
    cameras: Sequence[str] | None = None,
    tip_pose: TipPose | None = None,
    track: Track = iter,
) -> list[Finding]:
    """Everything that looks wrong in a store of demonstrations, or in a folder in RLBench's layout.

    Args:
        path: a store, or anything that `imop.demos.rlbench.episodes` accepts.
        cameras: which cameras every episode of a folder of RLBench should contain, by default those of
            `POLICY_CAMERAS` that any of them has; a store says so itself.
        tip_pose: forward kinematics of the robot, (7,) joint positions -> (4, 4) T_world_gripper; without it
            gripper poses are not compared with joint positions.
        track: wraps the episode numbers, to show progress.

    Returns:
        The findings in the order of the episodes; empty if nothing is wrong.

    Raises:
        InvalidInput: if there is neither a store nor an episode at `path`, or `cameras` has unknown names.
    """
    if cameras is not None:
        check_names(cameras)
    if (Path(path) / "zarr.json").exists() or "://" in str(path):
        return list(_check_store(path, tip_pose, track))
    folders = episodes(path)
    wanted = _usual_cameras(folders) if cameras is None else cameras
    return [f for i in track(range(len(folders))) for f in check_episode(folders[i], wanted, tip_pose)]


def _usual_cameras(folders: Sequence[Path]) -> Sequence[str]:
    recorded = {camera for folder in folders for camera in recorded_cameras(folder)}
    return [camera for camera in POLICY_CAMERAS if camera in recorded] or POLICY_CAMERAS


def _check_store(path: Path | str, tip_pose: TipPose | None, track: Track) -> Iterator[Finding]:
    try:
        store = DemonstrationStore.open(path, verify=False)
        count = len(store)
    except CorruptData as error:
        yield Finding.of(error, str(path))
        return
    if not count:
        yield Finding("error", str(path), "the store is empty", "record or import demonstrations into it")
    for index in track(range(count)):
        where = f"{path}/episode_{index:06d}"
        try:
            yield from check_demonstration(store[index], where, tip_pose)
        except ImopError as error:
            yield Finding.of(error, where)
