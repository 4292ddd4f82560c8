"""What a benchmark of single predictions counts."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from imop.evaluation.statistics import wilson
from imop.geometry.accuracy import COARSE, FINE


@dataclass(frozen=True)
class Row:
    """One step of one scene, asked of one method.

    Attributes:
        method: its name.
        task: name within the suite.
        variation: of the task.
        support: the demonstration: seed of its scene, or name of the recording.
        query: the scene, likewise.
        step: number of the keyframe.
        object: what the step is fixed to, where known.
        problem: why nothing was predicted; empty if something was.
        pose: the predicted position and quaternion xyzw.
        position: metres to the nearest right pose, see `equal_poses`; None if nothing was predicted.
        rotation: degrees to the same pose.
        plain_position: metres to the recorded pose itself.
        plain_rotation: degrees to the recorded pose itself.
        confidence: the policy's.
        milliseconds: from the images to the pose.
        region_iou: overlap of the policy's region with the step's object in the demonstration, where known.
        routed: step that the policy's own router chose, if it has one.
        repeatable: whether the demonstrated motion of the gripper, repeated from where the gripper is in the
            query, ends near a right pose: then the recorded state gives the answer away.
    """

    method: str
    task: str
    variation: int
    support: str
    query: str
    step: int
    object: str | None
    problem: str = ""
    pose: tuple[float, ...] | None = None
    position: float | None = None
    rotation: float | None = None
    plain_position: float | None = None
    plain_rotation: float | None = None
    confidence: float | None = None
    milliseconds: float = 0.0
    region_iou: float | None = None
    routed: int | None = None
    repeatable: bool = False

    def within(self, limits: tuple[float, float]) -> bool:
        """Whether a right pose is nearer than `limits`, metres and degrees."""
        return _within(self.position, self.rotation, limits)

    def plainly_within(self, limits: tuple[float, float]) -> bool:
        """Whether the recorded pose is nearer than `limits`, metres and degrees."""
        return _within(self.plain_position, self.plain_rotation, limits)

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


def _within(position: float | None, rotation: float | None, limits: tuple[float, float]) -> bool:
    return position is not None and rotation is not None and position < limits[0] and rotation < limits[1]


def summary(rows: Sequence[Row]) -> dict[str, Any]:
    """Counts and medians of some rows; what nothing is known of is None. A missing prediction is a miss."""
    n = len(rows)
    fine, coarse = sum(row.within(FINE) for row in rows), sum(row.within(COARSE) for row in rows)
    hard = [row.within(COARSE) for row in rows if not row.repeatable]
    return {
        "n": n,
        "within_1cm_5deg": fine / n,
        "within_1cm_5deg_interval": wilson(fine, n),
        "within_2cm_10deg": coarse / n,
        "within_2cm_10deg_interval": wilson(coarse, n),
        "within_2cm_10deg_of_the_recorded_pose": sum(row.plainly_within(COARSE) for row in rows) / n,
        "not_repeatable": len(hard),
        "within_2cm_10deg_of_not_repeatable": sum(hard) / len(hard) if hard else None,
        "missing": sum(bool(row.problem) for row in rows) / n,
        "position_median_m": _median([row.position for row in rows]),
        "position_p90_m": _median([row.position for row in rows], 90),
        "rotation_median_deg": _median([row.rotation for row in rows]),
        "rotation_p90_deg": _median([row.rotation for row in rows], 90),
        "region_iou_mean": _mean([row.region_iou for row in rows]),
        "routing_accuracy": _mean([None if row.routed is None else row.routed == row.step for row in rows]),
        "milliseconds_median": _median([row.milliseconds for row in rows]),
        "confidence_median": _median([row.confidence for row in rows]),
    }


def by_task(rows: Sequence[Row]) -> dict[str, Any]:
    """Summaries of one method's rows: of all, of each task, and of each step of each task."""
    tasks = {row.task: [other for other in rows if other.task == row.task] for row in rows}
    return {
        "all": summary(rows),
        "tasks": {
            task: {
                "all": summary(mine),
                "steps": {
                    str(step): summary([row for row in mine if row.step == step])
                    for step in sorted({row.step for row in mine})
                },
            }
            for task, mine in tasks.items()
        },
    }


def _median(values: Sequence[float | None], percent: float = 50) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.percentile(known, percent)) if known else None


def _mean(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None
