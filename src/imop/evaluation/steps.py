"""What is told of an episode: its steps, and how it ended. Needs no simulator."""

from dataclasses import asdict, dataclass

from rich.table import Table

from imop.evaluation.predict import deviation


@dataclass(frozen=True)
class Step:
    """One action of an episode.

    Attributes:
        support_step: demonstrated step that was transferred, or None.
        position_error: metres to where the expert would go from the same state, or None if it has no say; of
            several poses that look the same the nearest counts.
        rotation_error: radians, likewise.
        confidence: the policy's.
        policy_seconds: time to decide.
        motion_seconds: time to plan and simulate.
        plan_failed: reason, if no motion was found.
        generator: who proposed the motion, see `policy/proposals.py`; empty if nobody competed.
        reachable: whether the arm can go there; None if that was not asked.
        disturbed: whether something went wrong after it through no fault of the policy.
    """

    support_step: int | None
    position_error: float | None
    rotation_error: float | None
    confidence: float
    policy_seconds: float
    motion_seconds: float
    plan_failed: str | None = None
    generator: str = ""
    reachable: bool | None = None
    disturbed: bool = False


@dataclass(frozen=True)
class Rollout:
    """How an episode went; `reason` says why it ended."""

    success: bool
    reason: str
    steps: tuple[Step, ...]

    def as_dict(self) -> dict[str, object]:
        """Plain values for JSON."""
        return asdict(self)


def steps_table(result: Rollout) -> Table:
    """The steps of an episode for the terminal."""
    table = Table()
    columns = (
        "action",
        "support step",
        "proposed by",
        "probability",
        "off the expert",
        "decided in",
        "moved in",
    )
    for column in columns:
        table.add_column(column, justify="right")
    for number, step in enumerate(result.steps):
        table.add_row(
            str(number),
            "-" if step.support_step is None else str(step.support_step),
            step.generator or "-",
            f"{step.confidence:.2f}" + ("" if step.reachable is not False else ", out of reach"),
            deviation(step.position_error, step.rotation_error),
            f"{step.policy_seconds:.2f} s",
            step.plan_failed or f"{step.motion_seconds:.2f} s",
        )
    return table
