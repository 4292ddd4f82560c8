"""What can be wrong with a calibration: a name, what was seen, and what to do."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from imop.errors import ImopError

Kind = Literal[
    "few",
    "alike",
    "still",
    "inverted",
    "robot_units",
    "quaternion_order",
    "angle_units",
    "square_size",
    "out_of_step",
    "intrinsics",
    "outlier",
    "knocked",
    "unexplained",
    "imprecise",
    "views_disagree",
    "robot_elsewhere",
]
"""`few` and `alike`: too few pictures, or pictures that look alike, so that nothing can be told apart.
`still`: the robot's poses do not turn while the pictures do. `inverted`, `robot_units`, `quaternion_order`,
`angle_units`: the robot's poses mean something else. `out_of_step`: pictures belong to the poses before or
after. `outlier`: one shot does not fit. `knocked`: a camera was moved. `unexplained`: pictures and poses do
not fit, and no cause was found. `imprecise`: leaving out one shot moves the result. `views_disagree`,
`robot_elsewhere`: depth images show a surface, or the arm, where it is not."""


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong.

    Attributes:
        kind: its name.
        severity: with an error the result is not to be used.
        where: camera or shot.
        problem: what is wrong, with numbers.
        remedy: how to mend it.
    """

    kind: Kind
    severity: Literal["error", "warning"]
    where: str
    problem: str
    remedy: str

    def __str__(self) -> str:
        return f"{self.severity}: {self.where}: {self.problem} ({self.kind}); remedy: {self.remedy}"


class NotCalibrated(ImopError):
    """Pictures and poses do not determine where the cameras are; `problems` say why."""

    def __init__(self, problems: Sequence[Problem]):
        self.problems = tuple(problems)
        super().__init__("calibration: " + " | ".join(str(problem) for problem in problems))
