"""One step of an expert."""

from dataclasses import dataclass

from imop.errors import InvalidInput
from imop.sim.world import World
from imop.types import FloatArray, as_pose


@dataclass(frozen=True, eq=False)
class Waypoint:
    """A gripper pose in the frame of a body, and what the gripper does there.

    Attributes:
        frame: name of the body whose frame the pose is given in. It must not move before the waypoint's
            turn, so that what is reachable at the start stays so.
        T_frame_gripper: (4, 4).
        gripper_open: state of the gripper after the motion.
        allow_collisions: whether the motion may touch things.
        linear: whether a scene is fit only if the tip can come here on a straight line.
        opening: where the expert's fingers stop, 0 closed .. 1 open; at the end of their way if None. The
            action that is recorded, and that a policy gives, knows open and closed only.

    Raises:
        InvalidInput: if a value is out of its range.
    """

    frame: str
    T_frame_gripper: FloatArray
    gripper_open: bool
    allow_collisions: bool = False
    linear: bool = False
    opening: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "T_frame_gripper", as_pose("T_frame_gripper", self.T_frame_gripper))
        if self.opening is not None and not 0 <= self.opening <= 1:
            raise InvalidInput("opening", f"{self.opening}", "0 (closed) .. 1 (open), or None")

    def target(self, world: World) -> FloatArray:
        """T_world_gripper (4, 4) with the frame where it is now."""
        return world.pose(self.frame) @ self.T_frame_gripper
