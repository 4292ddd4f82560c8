"""What a check found."""

from dataclasses import dataclass
from typing import Literal, Self

from imop.errors import CorruptData, ImopError, InvalidInput


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong with recorded data.

    Attributes:
        severity: an error makes the data useless or misleading; a warning may be intended.
        where: file or folder, step, camera, field.
        problem: what is wrong, with numbers.
        remedy: how to mend it.
    """

    severity: Literal["error", "warning"]
    where: str
    problem: str
    remedy: str

    @classmethod
    def of(cls, error: ImopError, where: str) -> Self:
        """The error that made `where` unreadable."""
        if isinstance(error, CorruptData):
            return cls("error", str(error.path), error.problem, error.remedy)
        if isinstance(error, InvalidInput):
            return cls("error", f"{where}, {error.field}", error.problem, f"give {error.accepted}")
        return cls("error", where, str(error), "record it again")

    def __str__(self) -> str:
        return f"{self.severity}: {self.where}: {self.problem}; remedy: {self.remedy}"
