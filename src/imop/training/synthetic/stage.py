"""A table with things on it, posed by hand instead of by physics, seen by the robot's cameras."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from imop.errors import ImopError
from imop.extras import extra
from imop.geometry import se3
from imop.geometry.cloud import PointCloud
from imop.geometry.perception import Perception
from imop.networks.graph import GraphConfig, thin
from imop.robots.panda import FINGER_STROKE, PANDA_HOME_Q, panda_self_filter
from imop.sim.cameras import CAMERAS, Camera, observe
from imop.sim.depth_noise import DepthNoise
from imop.sim.kinematics import inverse_kinematics
from imop.sim.parts.shapes import add_to
from imop.sim.world import TABLE_HEIGHT, World, scene_spec
from imop.training.data.shards import STORED
from imop.training.synthetic.families.thing import Thing
from imop.types import FloatArray, Observation

with extra("sim"):
    import mujoco

_SPACING = 0.012

Joints = Mapping[tuple[int, str], float]


class Unreachable(ImopError):
    """The arm cannot take the gripper to a pose."""


@dataclass(frozen=True, eq=False)
class State:
    """Where everything is.

    Attributes:
        poses: (things, 4, 4) T_world_body.
        joints: (thing, joint) -> position; joints that are not named are at 0.
        T_world_gripper: (4, 4).
        opening: of the gripper, 0 .. 1; less than 1 also when it is open around something narrow.
        gripper_open: whether it holds nothing and is not closed.
        q: (7,) of the arm.
        held: the thing in the hand, or None.
    """

    poses: FloatArray
    joints: Joints = field(default_factory=dict)
    T_world_gripper: FloatArray = field(default_factory=lambda: np.eye(4))
    opening: float = 1.0
    gripper_open: bool = True
    q: FloatArray = field(default_factory=lambda: PANDA_HOME_Q)
    held: int | None = None

    def reached(self, T_world_gripper: FloatArray) -> "State":
        """The state with the gripper, and what it holds, moved to a pose.

        Raises:
            Unreachable: if the arm cannot take it there.
        """
        q = inverse_kinematics(T_world_gripper, self.q, 1)
        if not len(q):
            raise Unreachable("out of the arm's reach")
        poses = self.poses
        if self.held is not None:
            poses = poses.copy()
            poses[self.held] = T_world_gripper @ se3.invert(self.T_world_gripper) @ poses[self.held]
        return replace(self, poses=poses, T_world_gripper=T_world_gripper, q=q[0])


class Stage:
    """Things compiled into one scene, to be posed and looked at any number of times."""

    def __init__(self, things: Sequence[Thing], cameras: Mapping[str, Camera] = CAMERAS):
        self.things, self._cameras = tuple(things), cameras
        spec = scene_spec()
        # Nothing is simulated, and things that stand in each other make thousands of contacts.
        spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
        for i, thing in enumerate(things):
            add_to(spec, f"thing{i}", thing.part)
        self._world = World(spec)
        self._perception = Perception(panda_self_filter().is_robot)
        self.links: tuple[dict[str, int], ...] = tuple(self._links(i) for i in range(len(things)))
        """For each thing, its bodies that move on their own: name in the part -> instance id."""
        self.home = self._world.T_world_gripper
        self._solid = tuple(self._sample(i) for i in range(len(things)))

    def _links(self, thing: int) -> dict[str, int]:
        prefix, found = f"thing{thing}/", {}
        for instance, name in self._world.instance_names.items():
            if name.startswith(prefix):
                found[name.removeprefix(prefix)] = instance
        return found

    def _sample(self, thing: int) -> FloatArray:
        """(N, 3) points that fill the boxes around the thing's geoms, in its frame, joints at 0."""
        model, data, points = self._world.model, self._world.data, []
        T_body_world = se3.invert(self._world.pose(f"thing{thing}/body"))
        for geom in range(model.ngeom):
            if not model.body(model.geom_bodyid[geom]).name.startswith(f"thing{thing}/"):
                continue
            center, half = model.geom_aabb[geom][:3], model.geom_aabb[geom][3:]
            axes = [
                np.linspace(-h, h, max(2, 1 + int(np.ceil(2 * h / _SPACING)))) if h > 0 else np.zeros(1)
                for h in half
            ]
            inside = center + np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
            T = se3.make(data.geom_xmat[geom].reshape(3, 3), data.geom_xpos[geom])
            points.append(se3.apply(T_body_world @ T, inside))
        return np.concatenate(points)

    def footprint(self, thing: int, R: FloatArray) -> tuple[FloatArray, float]:
        """Its points (N, 2) seen from above when turned by `R`, and how deep it reaches below its origin."""
        turned = self._solid[thing] @ R.T
        return turned[:, :2], float(-turned[:, 2].min())

    def top(self, thing: int) -> float:
        """Z of its highest point in its own frame, metres."""
        return float(self._solid[thing][:, 2].max())

    def bottom(self, thing: int) -> float:
        """Z of its lowest point in its own frame, metres."""
        return float(self._solid[thing][:, 2].min())

    def link_in_body(self, thing: int, link: str, position: float) -> FloatArray:
        """T_body_link (4, 4) with the joint of the link at `position`."""
        poses = self.link_poses(State(np.stack([np.eye(4)] * len(self.things)), {(thing, link): position}))
        return se3.invert(poses[thing, "body"]) @ poses[thing, link]

    def mount(self, thing: int) -> FloatArray:
        """T_body_mount (4, 4), what of the thing comes to a spot."""
        mount = self.things[thing].mount
        return se3.make(p=(0, 0, self.bottom(thing))) if mount is None else mount

    def pose(self, state: State) -> None:
        """Put everything where the state says."""
        world = self._world
        for i, T in enumerate(state.poses):
            body = world.model.body(f"thing{i}/body")
            if body.jntnum[0]:
                start = int(world.model.jnt_qposadr[body.jntadr[0]])
                world.data.qpos[start : start + 7] = (*T[:3, 3], *se3.to_wxyz(T))
            else:
                body.pos, body.quat = T[:3, 3], se3.to_wxyz(T)
            for link in self.links[i]:
                if link != "body":
                    joint = world.model.joint(f"thing{i}/{link}")
                    world.data.qpos[joint.qposadr[0]] = state.joints.get((i, link), 0.0)
        world.set_robot(state.q, state.opening)

    def link_poses(self, state: State) -> dict[tuple[int, str], FloatArray]:
        """(thing, link) -> T_world_link (4, 4)."""
        self.pose(state)
        return {
            (i, link): self._world.pose(f"thing{i}/{link}")
            for i, links in enumerate(self.links)
            for link in links
        }

    def observe(
        self, state: State, noise: DepthNoise, rng: np.random.Generator, size: int = 128
    ) -> Observation:
        """What the cameras see in `size` x `size` pixels, with the noise of real ones."""
        self.pose(state)
        return noise(observe(self._world, size=size, cameras=self._cameras), rng)

    def clean(self, state: State, cameras: Mapping[str, Camera], size: int) -> Observation:
        """What these cameras would see without any noise."""
        self.pose(state)
        return observe(self._world, size=size, cameras=cameras)

    def cloud(
        self,
        state: State,
        noise: DepthNoise,
        rng: np.random.Generator,
        stored: GraphConfig = STORED,
        size: int = 128,
    ) -> PointCloud:
        """The cloud of a state as training stores it, with instance ids, from images of `size` x `size`."""
        return self.stored(self.observe(state, noise, rng, size), stored)

    def stored(self, observation: Observation, stored: GraphConfig = STORED) -> PointCloud:
        """The cloud of an observation as training stores it, with instance ids."""
        return thin(self._perception(observation), stored)[0]


def above_table(R: FloatArray, x: float, y: float, depth: float) -> FloatArray:
    """T_world_body (4, 4) of a thing that stands on the table at (x, y)."""
    return se3.make(R, (x, y, TABLE_HEIGHT + depth))


def opening_for(width: float) -> float:
    """Opening of the gripper, 0 .. 1, whose fingers are `width` metres apart."""
    return float(np.clip(width / (2 * FINGER_STROKE), 0.0, 1.0))
