"""What RLBench's tasks share: a model file, its random placement, its waypoints, and conditions."""

# ruff: noqa: D102 (the methods are described in Task)
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from imop.errors import PlanFailed
from imop.geometry import se3
from imop.robots.panda import PANDA_HOME_Q
from imop.sim.kinematics import inverse_kinematics
from imop.sim.motion import INSIDE, WORKSPACE_LOWER, Planner
from imop.sim.resize import resize
from imop.sim.world import ROBOT, World
from imop.tasks.checks import settle, touched
from imop.tasks.coppelia.convert import add_model
from imop.tasks.coppelia.model import Model, PathObject
from imop.tasks.coppelia.resized import resized
from imop.tasks.layout import NoRoom, first_valid
from imop.tasks.rlbench import assets
from imop.tasks.rlbench.conditions import Condition
from imop.tasks.rlbench.instances import separate, unavoided
from imop.tasks.rlbench.scene import Scene
from imop.tasks.rlbench.spawn import WORKSPACE, Boundary, area, place_in
from imop.tasks.rlbench.waypoints import OPEN, numbered, path_poses, read_words, thing_of
from imop.tasks.task import Task
from imop.tasks.waypoint import Waypoint
from imop.types import FloatArray

DOWN = se3.euler(x=np.pi) @ se3.euler(z=np.pi)
"""Orientation of the tip that looks down, its x axis towards the robot's base."""
_ON_THE_WAY, _DEPTH = 12, 0.003
_IN_PLACE = 0.005
_STOPPING = 0.05
"""Seconds in which a loose thing loses most of its speed."""
_ATTEMPTS = 300
_DRAWS = 100


@dataclass(frozen=True, eq=False)
class Step:
    """A waypoint of the file, where it shall be.

    Attributes:
        waypoint: its name, whose words count.
        T_world_tip: (4, 4); where the waypoint is now if None.
        frame: body on which the step depends; the shape that the waypoint hangs on if None.
    """

    waypoint: str
    T_world_tip: FloatArray | None = None
    frame: str | None = None


def _hits(world: World, bodies: frozenset[int]) -> bool:
    """Whether any of some bodies is in something that does not give way."""
    m = world.model
    deep = [c.geom for c in world.data.contact[: world.data.ncon] if c.dist < -_DEPTH]
    pairs = [m.geom_bodyid[geoms].tolist() for geoms in deep]
    both_ways = [pair for a, b in pairs for pair in ((a, b), (b, a))]
    return any(a in bodies and m.body_weldid[b] == 0 for a, b in both_ways)


def carried(
    scene: Scene, frame: str, moved: str, T_world_moved: FloatArray, names: Sequence[str]
) -> list[Step]:
    """Waypoints that hang on waypoint `moved`, or are it, when that is moved to a pose (4, 4).

    Args:
        scene: the scene.
        frame: body on which they depend.
        moved: name of the waypoint.
        T_world_moved: (4, 4) where it shall be.
        names: of the waypoints in question.
    """
    return [Step(name, T_world_moved @ scene.pose(name, frame=moved), frame) for name in names]


class RLBenchTask(Task):
    """A task whose scene is a model file.

    Attributes:
        words: instructions, the usual one first; {} stands for the variation's aim.
        aims: what the instructions say of each variation.
        yaw: bounds of the turn of the whole task, radians.
        root: what is placed in the workspace, the whole task unless named.
        placed: whether it is placed at all.
        table_friction: coefficient of the table.
        loose: light things that must not jump when something hard pushes them.
        frames: waypoint -> body on which it depends, where that is not the shape it hangs on.
        scale: of everything in the file.
    """

    insist = True
    one_instance = True
    # Tasks whose files would be too large for the workspace say less, see `_place`.
    sizes: ClassVar[tuple[float, float] | None] = (0.85, 1.15)
    scale: float = 1.0
    # MuJoCo takes the greater friction of two things, the physics of RLBench the product.
    table_friction: ClassVar[float] = 0.3
    loose: ClassVar[tuple[str, ...]] = ()
    words: ClassVar[tuple[str, ...]]
    aims: ClassVar[tuple[str, ...]] = ("",)
    yaw: ClassVar[tuple[float, float]] = (-3.14, 3.14)
    root: ClassVar[str | None] = None
    placed: ClassVar[bool] = True
    frames: Mapping[str, str] = {}

    @abstractmethod
    def conditions(self) -> Sequence[Condition]:
        """What has to be met at once for success; made anew for every episode, after `init_episode`."""

    def fails(self) -> Sequence[Condition]:
        """What makes success impossible once it was met at once; nothing by default."""
        return ()

    def instructions(self, variation: int) -> tuple[str, ...]:
        return tuple(text.replace("{}", self.aims[variation]) for text in self.words)

    def load(self) -> Model:
        """The model of the scene.

        Raises:
            AssetMissing: if the user has not provided the file.
        """
        return assets.load(self.file())

    @classmethod
    def available(cls) -> bool:
        return assets.available(cls.file())

    @classmethod
    def file(cls) -> str:
        """Name of the model file, without .ttm."""
        return cls.name.split("/")[1]

    def resized(self, scale: float) -> Task:
        self.scale = scale
        return self

    def build(self, spec: Any, variation: int, rng: np.random.Generator) -> None:
        self.variation = variation
        self.model = self.load()
        before = {body.name for body in spec.worldbody.bodies}
        add_model(spec, self.model)
        if self.scale != 1.0:
            self._resize(spec, [body for body in spec.worldbody.bodies if body.name not in before])
        for geom in spec.body("table").geoms:
            geom.friction[0] = self.table_friction

    def _resize(self, spec: Any, bodies: Sequence[Any]) -> None:
        """Things stay on the plane on which they stand, in the scene and in what the file says of them."""
        x, y, _ = self.model.T_world_moved[0][:3, 3]
        on_table = np.array([x, y, WORKSPACE.T_world_area[2, 3]])
        resize(spec, bodies, self.scale, on_table)
        self.model = resized(self.model, self.scale, on_table)

    def prepare(self, world: World) -> None:
        separate(world, self.model)

    def init_episode(self, scene: Scene, rng: np.random.Generator) -> None:
        """Arrange the variation's scene, before the task is placed as a whole; nothing by default.

        Raises:
            NoRoom: if something found no place.
        """

    def steps(self, scene: Scene) -> Sequence[Step]:
        """The waypoints in their order; those of the file by default."""
        return [Step(name) for name in numbered(scene.model)]

    def reset(self, world: World, rng: np.random.Generator) -> None:
        scene = Scene(world, self.model, scale=self.scale)
        world.unavoided = unavoided(world, self.model)
        for name in self.loose:
            first, body = int(world.model.joint(name).dofadr[0]), world.model.body(name)
            world.model.dof_damping[first : first + 6] = [
                *(3 * [body.mass[0] / _STOPPING]),
                *(body.inertia / _STOPPING),
            ]

        def draw() -> str:
            self.init_episode(scene, rng)
            self._begun = scene.joints()
            self._conditions, self._fails, self._failed = self.conditions(), self.fails(), False
            if self.placed:
                self._place(scene, rng)
            return self._problem(world)

        first_valid(world, self.name, draw, _ATTEMPTS)
        settle(world)

    def _place(self, scene: Scene, rng: np.random.Generator) -> None:
        root = self.root or self.model.objects[0].name
        for _ in range(_DRAWS):
            T = place_in(scene, rng, WORKSPACE, root, self.yaw)
            if T is not None:
                scene.place(root, T)
                return
        raise NoRoom(f"{root}: does not fit into the workspace")

    def _problem(self, world: World) -> str:
        """Why the expert could not begin or reach its waypoints, or an empty string."""
        if things := touched(world):
            return f"the arm touches {things}"
        steps = self.waypoints(world)
        if not all(len(inverse_kinematics(w.target(world), PANDA_HOME_Q, 1)) for w in steps):
            return "a waypoint is out of reach"
        # On a straight way the hand may touch what it works on.
        links = frozenset(int(world.model.body(f"{ROBOT}link{i}").id) for i in range(1, 8))
        state = world.save_state()
        try:
            for w in steps:
                plan = Planner(world).plan(w.target(world), allow_collisions=True, linear=w.linear)
                # Where collisions matter the real motion may be another one, which ends there, too.
                first = 0 if w.allow_collisions else len(plan.positions) - 1
                for k in np.linspace(first, len(plan.positions) - 1, _ON_THE_WAY).astype(int):
                    world.set_robot(plan.positions[k], 1.0)
                    if _hits(world, links if plan.straight else world.robot_bodies):
                        return "the arm would hit something"
        except PlanFailed as error:
            return error.reason
        finally:
            world.restore_state(state)
        return ""

    def waypoints(self, world: World) -> Sequence[Waypoint]:
        scene, opening, found = Scene(world, self.model, scale=self.scale), 1.0, []
        p_before = world.T_world_gripper[:3, 3]
        for step in self.steps(scene):
            words = read_words(self.model[step.waypoint].extension)
            T = scene.pose(step.waypoint) if step.T_world_tip is None else step.T_world_tip
            frame = step.frame or self.frames.get(step.waypoint) or thing_of(self.model, step.waypoint)
            o = self.model[step.waypoint]
            poses = T @ path_poses(o, self.scale) if isinstance(o, PathObject) else T[None].copy()
            # RLBench follows paths without a look at what is in the way, whatever their words say.
            free = words.ignore_collisions or isinstance(o, PathObject)
            # Things that sank onto the table may put waypoints below the workspace, by two millimetres.
            poses[:, 2, 3] = np.maximum(poses[:, 2, 3], WORKSPACE_LOWER[2] + INSIDE)
            T_frame_poses = se3.invert(scene.pose(frame)) @ poses
            for k, T_frame_gripper in enumerate(T_frame_poses):
                last = k == len(poses) - 1
                # What is turned in place would be dragged away on any other way.
                in_place = np.linalg.norm(poses[k, :3, 3] - p_before) < _IN_PLACE and opening <= OPEN
                linear = words.linear or len(poses) > 1 or bool(in_place)
                p_before = poses[k, :3, 3]
                opening = words.opening if last and words.opening is not None else opening
                found.append(Waypoint(frame, T_frame_gripper, opening > OPEN, free, linear, opening))
        return found

    def watch(self, world: World) -> None:
        scene = self._scene(world)
        self._met(scene)
        self.on_step(scene)

    def _scene(self, world: World) -> Scene:
        return Scene(world, self.model, self._begun, self.scale)

    def on_step(self, scene: Scene) -> None:
        """Change what the task changes while it is done, such as a lock; every 0.05 s, nothing by default."""

    def success(self, world: World) -> bool:
        return self._met(self._scene(world))

    def _met(self, scene: Scene) -> bool:
        met = [c.met(scene) for c in self._conditions]
        failed = [c.met(scene) for c in self._fails]
        self._failed = self._failed or (bool(failed) and all(failed))
        return all(met) and not self._failed

    @staticmethod
    def boundary(scene: Scene, rng: np.random.Generator, *planes: str) -> Boundary:
        """Room for things on planes of the model."""
        return Boundary(scene, rng, [area(scene, plane) for plane in planes])
