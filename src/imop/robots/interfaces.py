"""What imop asks of an arm with a gripper, simulated or real: its state, and motions that may fail.

A driver speaks in the frame of the arm's base. What is wrong with an arm is a value, not an exception: a
`MotionResult` names the reason, and after `recover` one can go on.
"""

from dataclasses import dataclass
from typing import Literal, Protocol, get_args

from imop.errors import InvalidInput, PlanFailure
from imop.types import FloatArray, as_finite, as_fraction, as_pose, freeze

MotionFailure = Literal[
    PlanFailure,
    "stopped",  # somebody called `stop`
    "not_arrived",  # the arm rests elsewhere, or did not come to rest in time
    "speed_limit",  # the motion would be faster than allowed
    "protective_stop",  # the arm's own safety stopped it, a contact for example
    "not_ready",  # brakes closed, an error not yet recovered, not in remote control
    "disconnected",
]
"""Why a motion was not done."""
REASONS: tuple[str, ...] = get_args(MotionFailure)


@dataclass(frozen=True, eq=False)
class RobotState:
    """What an arm measures at one moment.

    Attributes:
        T_base_gripper: (4, 4) measured pose of the gripper frame, in the frame of the arm's base.
        gripper_opening: 0 closed .. 1 open, fraction of the stroke; values up to 0.01 outside are clipped.
        joint_positions: (J,) measured, radians.
        stamp: seconds of the clock that the cameras' frames have too.

    Raises:
        InvalidInput: for a value that is none of these.
    """

    T_base_gripper: FloatArray
    gripper_opening: float
    joint_positions: FloatArray
    stamp: float = 0.0

    def __post_init__(self) -> None:
        freeze(
            self,
            T_base_gripper=as_pose("T_base_gripper", self.T_base_gripper),
            gripper_opening=as_fraction("gripper_opening", self.gripper_opening),
            joint_positions=as_finite("joint_positions", self.joint_positions, (None,)),
            stamp=float(as_finite("stamp", self.stamp, ())),
        )


@dataclass(frozen=True)
class MotionResult:
    """Whether a motion was done, and if not, why.

    Attributes:
        done: whether the arm rests where it should.
        reason: why it does not; None if it does.
        detail: what the driver or the planner said, for people.

    Raises:
        InvalidInput: for a reason without failure, a failure without reason, or an unknown reason.
    """

    done: bool
    reason: MotionFailure | None = None
    detail: str = ""

    def __post_init__(self) -> None:
        if self.done == (self.reason is not None):
            raise InvalidInput("reason", f"{self.reason} with done={self.done}", "a reason if not done")
        if self.reason is not None and self.reason not in REASONS:
            raise InvalidInput("reason", f"{self.reason!r}", ", ".join(REASONS))


DONE = MotionResult(True)


class Robot(Protocol):
    """One arm with a gripper. Only `state` and `stop` may be called while another call has not returned.

    A motion returns when the arm rests. It never raises for what goes wrong with the arm, and leaves the
    arm at rest if it is not done.
    """

    def state(self) -> RobotState:
        """What the arm measures now.

        Raises:
            ConnectionError: if the arm does not answer.
        """
        ...

    def move_to(
        self, T_base_gripper: FloatArray, *, straight: bool = False, allow_collisions: bool = False
    ) -> MotionResult:
        """Bring the gripper to a pose.

        Args:
            T_base_gripper: (4, 4), in the frame of the arm's base.
            straight: whether only a straight line of the gripper will do.
            allow_collisions: whether the arm may touch things, and is done where it is stopped by what it
                touches; a driver that can tell neither ignores it.

        Raises:
            InvalidInput: if the pose is no rigid transformation.
        """
        ...

    def move_gripper(self, opening: float) -> MotionResult:
        """Bring the fingers to an opening, 0 closed .. 1 open; held things that stop them are no failure.

        Raises:
            InvalidInput: if the opening is not between 0 and 1.
        """
        ...

    def stop(self) -> None:
        """Bring the arm to rest at once; may be called from any thread, at any time, repeatedly.

        A motion that is being done then returns with the reason "stopped". One that begins later is done.
        """
        ...

    def recover(self) -> MotionResult:
        """Clear the arm's errors, so that motions are accepted again; done if there are none."""
        ...
