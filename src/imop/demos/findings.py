"""What a check found."""

from dataclasses import dataclass
from typing import Literal


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

    def __str__(self) -> str:
        return f"{self.severity}: {self.where}: {self.problem}; remedy: {self.remedy}"
