"""Which points of a scene are the robot itself, from its joints and its shape."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from imop.errors import InvalidInput
from imop.geometry import primitives, se3
from imop.types import BoolArray, FloatArray, as_array, as_pose

_ANALYTIC: dict[int, Callable[[FloatArray, FloatArray], FloatArray]] = {
    int(mujoco.mjtGeom.mjGEOM_SPHERE): primitives.sphere,
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): primitives.capsule,
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): primitives.cylinder,
    int(mujoco.mjtGeom.mjGEOM_BOX): primitives.box,
    int(mujoco.mjtGeom.mjGEOM_ELLIPSOID): primitives.ellipsoid,
}


@dataclass(frozen=True)
class _Solid:
    """One geom: its distance function, and a sphere around it grown by the margin."""

    geom: int
    distance: Callable[[FloatArray, FloatArray], FloatArray]
    shape: FloatArray
    margin: float
    reach: float


class SelfFilter:
    """Tells the robot's points from those of the scene by its own geometry at the measured joints.

    Every geom of the kinematic tree that contains the joints counts as robot: spheres, capsules, cylinders,
    boxes and ellipsoids as they are, meshes by their convex hulls.

    Args:
        model: a model with the robot, alone or in a scene.
        joint_names: the arm's joints, in the order of the joint positions.
        finger_joint_names: the gripper's joints; an opening of 1 puts each at the upper end of its range.
        T_world_model: (4, 4), where the model's world frame lies in the world of the points.
        margin: how far beyond its surface a geom still removes points, metres; one number, or one per body
            name with "" for all others.

    Raises:
        InvalidInput: if a joint or body is not in the model, or a geom is of another type.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        joint_names: Sequence[str],
        finger_joint_names: Sequence[str] = (),
        T_world_model: FloatArray | None = None,
        margin: float | Mapping[str, float] = 0.01,
    ):
        self._model = model
        self._T_world_model = as_pose("T_world_model", np.eye(4) if T_world_model is None else T_world_model)
        joints = [_joint(model, name) for name in joint_names]
        if not joints:
            raise InvalidInput("joint_names", "empty", "the names of the arm's joints")
        fingers = [_joint(model, name) for name in finger_joint_names]
        self._arm = model.jnt_qposadr[joints]
        self._fingers = model.jnt_qposadr[fingers]
        self._finger_range = model.jnt_range[fingers].reshape(-1, 2)
        margins = {"": float(margin)} if isinstance(margin, int | float) else dict(margin)
        self._bodies = _solids(model, int(model.body_rootid[model.jnt_bodyid[joints[0]]]), margins)

    def is_robot(
        self, points: FloatArray, joint_positions: FloatArray, gripper_opening: float = 1.0
    ) -> BoolArray:
        """(N,) True for points on or in the robot.

        Args:
            points: (N, 3) world frame; points that are not finite are not robot.
            joint_positions: (n,) radians.
            gripper_opening: 0 closed .. 1 open.

        Raises:
            InvalidInput: if a shape is wrong, or a joint position or the opening is not finite.
        """
        points = as_array("points", points, (None, 3))
        data = self._posed(joint_positions, gripper_opening)
        # A point this far away is in no solid.
        known = np.nan_to_num(points, nan=1e6, posinf=1e6, neginf=1e6)
        p_model = se3.apply(se3.invert(self._T_world_model), known)
        robot = np.zeros(len(points), dtype=bool)
        centres, radii = _enclosing_spheres(self._bodies, data)
        # |p - c|^2 <= r^2 of all pairs in one product.
        beyond = np.einsum("ij,ij->i", p_model, p_model) - 2 * centres @ p_model.T
        reached = beyond <= (radii**2 - (centres**2).sum(axis=1) + 1e-9)[:, None]
        for solids, inside in zip(self._bodies, reached, strict=True):
            near = np.flatnonzero(inside)
            for solid in solids:
                near = near[~robot[near]]
                p_geom = (p_model[near] - data.geom_xpos[solid.geom]) @ data.geom_xmat[solid.geom].reshape(
                    3, 3
                )
                robot[near] = solid.distance(p_geom, solid.shape) <= solid.margin
        return robot

    def _posed(self, joint_positions: FloatArray, gripper_opening: float) -> mujoco.MjData:
        q = as_array("joint_positions", joint_positions, (len(self._arm),))
        if not np.all(np.isfinite(q)):
            raise InvalidInput("joint_positions", "not finite", f"{len(self._arm)} angles in radians")
        if not np.isfinite(gripper_opening):
            raise InvalidInput("gripper_opening", f"{gripper_opening}", "a number, 0 closed .. 1 open")
        data = mujoco.MjData(self._model)
        data.qpos[self._arm] = q
        lower, upper = self._finger_range.T
        data.qpos[self._fingers] = lower + np.clip(gripper_opening, 0, 1) * (upper - lower)
        mujoco.mj_kinematics(self._model, data)
        return data


def _joint(model: mujoco.MjModel, name: str) -> int:
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)
    if index < 0:
        names = ", ".join(model.joint(i).name for i in range(model.njnt))
        raise InvalidInput("joint_names", f"no joint {name!r}", names)
    return int(index)


def _solids(model: mujoco.MjModel, root: int, margins: Mapping[str, float]) -> list[list[_Solid]]:
    """The geoms of the tree under `root`, body by body."""
    bodies = [i for i in range(model.nbody) if model.body_rootid[i] == root]
    names = {model.body(i).name for i in bodies}
    if unknown := sorted(set(margins) - names - {""}):
        raise InvalidInput("margin", f"no body {unknown[0]!r}", ", ".join(sorted(names)))
    solids = []
    for body in bodies:
        margin = margins.get(model.body(body).name, margins.get("", 0.0))
        geoms = np.flatnonzero(model.geom_bodyid == body)
        if len(geoms):
            solids.append([_solid(model, int(geom), margin) for geom in geoms])
    return solids


def _solid(model: mujoco.MjModel, geom: int, margin: float) -> _Solid:
    kind, reach = int(model.geom_type[geom]), float(model.geom_rbound[geom]) + margin
    if kind in _ANALYTIC:
        return _Solid(geom, _ANALYTIC[kind], model.geom_size[geom].copy(), margin, reach)
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = int(model.geom_dataid[geom])
        start, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
        planes = primitives.half_spaces(model.mesh_vert[start : start + count].astype(np.float64))
        return _Solid(geom, primitives.convex, planes, margin, reach)
    name = mujoco.mjtGeom(kind).name
    raise InvalidInput(
        "model", f"geom {geom} is a {name}", "sphere, capsule, cylinder, box, ellipsoid or mesh"
    )


def _enclosing_spheres(
    bodies: Sequence[Sequence[_Solid]], data: mujoco.MjData
) -> tuple[FloatArray, FloatArray]:
    """(B, 3) centres and (B,) radii of spheres around the solids of each body, margins included."""
    centres, radii = [], []
    for solids in bodies:
        places = data.geom_xpos[[solid.geom for solid in solids]]
        centres.append(places.mean(axis=0))
        reach = np.array([solid.reach for solid in solids])
        radii.append((np.linalg.norm(places - centres[-1], axis=1) + reach).max())
    return np.stack(centres), np.array(radii)
