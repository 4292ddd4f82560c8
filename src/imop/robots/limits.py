"""How fast an arm may move."""

from dataclasses import dataclass

from imop.types import as_positive, freeze


@dataclass(frozen=True, eq=False)
class Limits:
    """How fast the arm may move. A driver keeps to them; `GuardedRobot` stops one that does not.

    Attributes:
        speed: of the gripper, metres per second.
        turn: of the gripper, radians per second.
        joint_speed: of every joint, radians per second.

    Raises:
        InvalidInput: for a value that cannot be, named as in the set-up.
    """

    speed: float = 0.25
    turn: float = 1.0
    joint_speed: float = 1.0

    def __post_init__(self) -> None:
        freeze(
            self,
            speed=as_positive("limits.speed", self.speed, 5.0, "metres per second"),
            turn=as_positive("limits.turn", self.turn, 10.0, "radians per second"),
            joint_speed=as_positive("limits.joint_speed", self.joint_speed, 10.0, "radians per second"),
        )
