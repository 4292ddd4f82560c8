"""A world together with the model that it was made of: objects by the names in the file."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from imop.geometry import se3
from imop.sim.world import World
from imop.tasks.coppelia.dynamics import is_moving_joint
from imop.tasks.coppelia.model import Joint, Model
from imop.tasks.coppelia.placing import place, place_position, recolor
from imop.tasks.coppelia.sensors import detects
from imop.tasks.rlbench.colors import COLORS
from imop.types import FloatArray


@dataclass(frozen=True, eq=False)
class Scene:
    """What a task's logic reads and moves. Moving an object moves all below it in the file's tree.

    Attributes:
        world: where everything is now.
        model: what the file says.
        begun: joint -> position (radians or metres) with which the episode began; the file's for others.
        scale: of everything over its size in the file, in which the numbers of a task's logic are given.
    """

    world: World
    model: Model
    begun: Mapping[str, float] = field(default_factory=dict)
    scale: float = 1.0

    def pose(self, name: str, frame: str | None = None) -> FloatArray:
        """(4, 4) in the world, or in the frame of another object."""
        T_world_object = self.world.pose(name)
        if frame is None:
            return T_world_object
        T: FloatArray = se3.invert(self.world.pose(frame)) @ T_world_object
        return T

    def point(self, frame: str, p: tuple[float, float, float]) -> FloatArray:
        """(3,) in the world, of a point given in the frame of an object, in the file's size."""
        p_world: FloatArray = (self.pose(frame) @ (*(self.scale * c for c in p), 1.0))[:3]
        return p_world

    def place(self, name: str, T_world_object: FloatArray) -> None:
        """Put an object at a pose."""
        place(self.world, self.model, name, T_world_object)

    def move(self, name: str, p_world: Sequence[float] | FloatArray) -> None:
        """Put an object at a position; it keeps its orientation."""
        place_position(self.world, self.model, name, p_world)

    def move_to(self, name: str, other: str) -> None:
        """Put an object where another is; it keeps its orientation."""
        self.move(name, self.pose(other)[:3, 3])

    def place_at(self, name: str, other: str) -> None:
        """Give an object the pose of another."""
        self.place(name, self.pose(other))

    def paint(self, name: str, color: str) -> None:
        """Give a shape, but not what hangs on it, one of `COLORS`."""
        recolor(self.world, name, COLORS[color])

    def let_go(self, weld: str) -> None:
        """Let go what a weld holds; nothing happens if that was done."""
        self.world.data.eq_active[self.world.model.equality(weld).id] = 0

    def detects(self, sensor: str, name: str) -> bool:
        """Whether a sensor detects a shape or a dummy now."""
        return detects(self.world, self.model, sensor, name)

    def joints(self) -> dict[str, float]:
        """Position of every hinge (radians) and slide (metres) that moves."""
        moving = (o for i, o in enumerate(self.model.objects) if is_moving_joint(self.model, i))
        names = [o.name for o in moving if isinstance(o, Joint) and o.kind != "spherical"]
        return {name: self.world.joint(name) for name in names}

    def moved(self, joint: str) -> float:
        """How far a joint is from where the episode began, radians, or metres in the file's size."""
        start = self.model[joint]
        assert isinstance(start, Joint)
        way = abs(self.world.joint(joint) - self.begun.get(joint, start.position))
        return way / self.scale if start.kind == "prismatic" else way
