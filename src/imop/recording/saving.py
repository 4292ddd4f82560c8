"""Stores demonstrations that were made of recordings: each once, and what is wrong with them is said."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from imop.demos.check_steps import TipPose, check_demonstration
from imop.demos.episode import digest_of
from imop.demos.findings import Finding
from imop.demos.store import DemonstrationStore
from imop.errors import CorruptData
from imop.recording.draft import Draft

Track = Callable[[Sequence[Draft]], Iterable[Draft]]


@dataclass(frozen=True)
class Saved:
    """What became of the drafts.

    Attributes:
        stored: how many are new in the store.
        there_already: how many it held before, with the same content.
        findings: what is wrong with the new ones, and why others could not be read.
    """

    stored: int
    there_already: int
    findings: tuple[Finding, ...]


def save_all(
    drafts: Sequence[Draft], out: Path, tip_pose: TipPose | None = None, track: Track = iter
) -> Saved:
    """Append demonstrations to a store, but for those that it holds already.

    Args:
        drafts: recordings with their keyframes.
        out: folder of the store; made if it does not exist.
        tip_pose: of the arm, to compare joints with poses.
        track: wraps the drafts, to show progress.

    Raises:
        InvalidInput: if `out` exists and is no store, or intrinsics, a camera's pose or the scale of its
            depth are missing; nothing more is stored then.
        CorruptData: if `out` is a damaged store.
    """
    exists = out.is_dir() and any(out.iterdir())
    store = DemonstrationStore.open(out) if exists else None
    known = set() if store is None else store.digests()
    stored, there_already = 0, 0
    findings: list[Finding] = []
    for draft in track(drafts):
        try:
            demonstration = draft.demonstration()
        except CorruptData as error:
            findings.append(Finding.of(error, draft.source.name))
            continue
        digest = digest_of(demonstration)
        if digest in known:
            there_already += 1
            continue
        findings += check_demonstration(demonstration, draft.source.name, tip_pose)
        store = DemonstrationStore.create(out) if store is None else store
        store.append(demonstration)
        known.add(digest)
        stored += 1
    return Saved(stored, there_already, tuple(findings))
