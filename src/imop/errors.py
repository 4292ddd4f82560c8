"""Every error that imop raises on purpose derives from `ImopError` and names what would be accepted."""

from pathlib import Path
from typing import Any, Literal


class ImopError(Exception):
    """Base of all errors raised on purpose.

    They survive pickling with message and attributes, whatever their constructors take: workers of other
    processes hand them over.
    """

    def __reduce__(self) -> tuple[Any, ...]:
        return _unpickled, (type(self), self.args), self.__dict__


def _unpickled(kind: type[ImopError], args: tuple[Any, ...]) -> ImopError:
    # The constructor would ask for what the message was made of; `args` holds the message itself.
    return kind.__new__(kind, *args)


class InvalidInput(ImopError, ValueError):
    """A value handed to imop does not have the required shape, type, unit or range."""

    def __init__(self, field: str, problem: str, accepted: str):
        self.field, self.problem, self.accepted = field, problem, accepted
        super().__init__(f"{field}: {problem}; accepted: {accepted}")


class CorruptData(ImopError):
    """A file or folder on disk cannot be read as what it claims to be."""

    def __init__(self, path: Path | str, problem: str, remedy: str = "restore it or record it again"):
        self.path, self.problem, self.remedy = Path(path), problem, remedy
        super().__init__(f"{path}: {problem}; remedy: {remedy}")


class ModelFormatError(ImopError):
    """A CoppeliaSim model is not what the format demands; `offset` counts bytes of the (unpacked) body."""

    def __init__(self, offset: int, problem: str, expected: str):
        self.offset, self.problem, self.expected = offset, problem, expected
        super().__init__(f"model: {problem} at byte {offset}; expected: {expected}")


class AssetMissing(ImopError):
    """A task needs a file that we may not distribute; `command` provides it."""

    def __init__(self, file: str, command: str):
        self.file, self.command = file, command
        super().__init__(f"{file}: not there; provide it with: {command}")


PlanFailure = Literal[
    "outside_workspace",
    "unreachable",
    "start_in_collision",
    "goal_in_collision",
    "no_path",
    "no_straight_path",
    "no_timing",
    "in_motion_collision",
]


class PlanFailed(ImopError):
    """No motion was found within the time allowed; `reason` says at which stage."""

    def __init__(self, reason: PlanFailure, detail: str = ""):
        self.reason: PlanFailure = reason
        super().__init__(f"T_world_gripper: no motion ({reason}){': ' + detail if detail else ''}")


class NoConfidentMatch(ImopError):
    """The demonstrated step could not be found in the scene with the confidence asked for."""

    def __init__(self, confidence: float, required: float):
        self.confidence, self.required = confidence, required
        super().__init__(f"confidence: {confidence:.2f} is below the required {required:.2f}")


class StageFailed(ImopError):
    """A command of a recipe did not do what it should; `log` holds all that it said."""

    def __init__(self, stage: str, code: int, log: Path):
        self.stage, self.code, self.log = stage, code, log
        remedy = "mend it and start the recipe again; what is done stays"
        super().__init__(f"{stage}: ended with exit code {code}, see the end of {log}; remedy: {remedy}")


class MissingExtra(ImopError):
    """An optional dependency is not installed."""

    def __init__(self, module: str, extra: str):
        self.module, self.extra = module, extra
        super().__init__(f"{module} is not installed; install it with: pip install 'imop[{extra}]'")
