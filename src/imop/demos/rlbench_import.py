"""Copies recordings in RLBench's layout into a store: each once, and what is wrong with them is said."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from imop.demos.check_rlbench import check_episode
from imop.demos.check_steps import TipPose
from imop.demos.episode import digest_of
from imop.demos.findings import Finding
from imop.demos.rlbench import check_names, episodes, read_episode
from imop.demos.store import DemonstrationStore
from imop.errors import CorruptData, InvalidInput

Track = Callable[[Sequence[Path]], Iterable[Path]]


@dataclass(frozen=True)
class Imported:
    """What became of the episodes.

    Attributes:
        stored: how many are new in the store.
        there_already: how many the store held before, from an import that was stopped or done twice.
        findings: what is wrong with the new ones, and why others could not be read.
    """

    stored: int
    there_already: int
    findings: tuple[Finding, ...]


def import_rlbench(
    source: Path | str,
    out: Path | str,
    cameras: Sequence[str] | None = None,
    tip_pose: TipPose | None = None,
    track: Track = iter,
) -> Imported:
    """Copy all episodes below `source` that can be read into the store `out`.

    Nothing that can be read is refused: what `check` calls an error is stored too, and is among the findings.
    Episodes that the store holds already, with the same content, are left out, so that an import that was
    stopped is continued by starting it again.

    Args:
        source: anything that `episodes` accepts.
        out: a new folder, or an existing store, which is appended to.
        cameras: as in `read_episode`.
        tip_pose: as in `check`.
        track: wraps the sequence of episode folders, to show progress.

    Raises:
        InvalidInput: if `out` exists and is not a store, there is no episode below `source`, or `cameras` has
            unknown names; if `out` cannot be written to, which says how many were stored.
        CorruptData: if `out` is a damaged store.
    """
    if cameras is not None:
        check_names(cameras)
    folders = episodes(source)
    exists = Path(out).is_dir() and any(Path(out).iterdir())
    store = DemonstrationStore.open(out) if exists else DemonstrationStore.create(out)
    known = store.digests()
    stored, there_already = 0, 0
    findings: list[Finding] = []
    for folder in track(folders):
        try:
            demonstration = read_episode(folder, cameras)
        except CorruptData as error:
            findings.append(Finding.of(error, str(folder)))
            continue
        digest = digest_of(demonstration)
        if digest in known:
            there_already += 1
            continue
        findings += check_episode(folder, list(demonstration.final.views), tip_pose, demonstration)
        try:
            store.append(demonstration)
        except OSError as error:
            problem = f"{error}; {stored} of {len(folders)} episodes were stored"
            raise InvalidInput("out", problem, "a folder that can be written to; run again") from error
        known.add(digest)
        stored += 1
    return Imported(stored, there_already, tuple(findings))
