"""The self-filter of any robot that MuJoCo can read."""

from collections.abc import Mapping, Sequence

import mujoco
import numpy as np

from imop.errors import InvalidInput
from imop.geometry import primitives, se3
from imop.geometry.self_filter import Distance, SelfFilter, Solid
from imop.types import FloatArray, as_pose

_ANALYTIC: dict[int, Distance] = {
    int(mujoco.mjtGeom.mjGEOM_SPHERE): primitives.sphere,
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): primitives.capsule,
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): primitives.cylinder,
    int(mujoco.mjtGeom.mjGEOM_BOX): primitives.box,
    int(mujoco.mjtGeom.mjGEOM_ELLIPSOID): primitives.ellipsoid,
}


def mjcf_self_filter(
    model: mujoco.MjModel,
    joint_names: Sequence[str],
    fingers: Sequence[str] | Mapping[str, tuple[float, float]] = (),
    T_world_model: FloatArray | None = None,
    margin: float | Mapping[str, float] = 0.01,
    finger_margin: float = 0.0015,
) -> SelfFilter:
    """The filter that knows the points of a robot in a MuJoCo model.

    Every geom of the kinematic tree that contains the joints counts as robot: spheres, capsules, cylinders,
    boxes and ellipsoids as they are, meshes by their convex hulls.

    Args:
        model: a model with the robot, alone or in a scene.
        joint_names: the arm's joints, in the order of the joint positions.
        fingers: the gripper's joints, each with its positions when the gripper is closed and when it is open.
            If only their names are given, those are the lower and the upper end of its range, which is wrong
            for fingers that open towards the lower end.
        T_world_model: (4, 4), where the model's world frame lies in the world of the points.
        margin: how far beyond its surface a geom still removes points, metres; one number, or one per body
            name with "" for all others.
        finger_margin: the same for bodies that the finger joints move and `margin` does not name. It is
            small: around the fingers is what they hold. It is never larger than that of all others.

    Raises:
        InvalidInput: if a joint or body is not in the model, or a geom is of another type.
    """
    T = as_pose("T_world_model", np.eye(4) if T_world_model is None else T_world_model)
    joints = [_joint(model, name) for name in joint_names]
    if not joints:
        raise InvalidInput("joint_names", "empty", "the names of the arm's joints")
    finger_joints = [_joint(model, name) for name in fingers]
    ends = fingers.values() if isinstance(fingers, Mapping) else model.jnt_range[finger_joints]
    closed, opened = np.reshape(list(ends), (-1, 2)).T
    margins = {"": float(margin)} if isinstance(margin, int | float) else dict(margin)
    of_fingers = min(finger_margin, margins.get("", 0.0))
    margins = _finger_margins(model, finger_joints, of_fingers) | margins
    bodies = _bodies(model, int(model.body_rootid[model.jnt_bodyid[joints[0]]]), margins)
    numbers = [geom for _, geoms in bodies for geom in geoms]

    def geom_poses(q: FloatArray, opening: float) -> FloatArray:
        data = mujoco.MjData(model)
        data.qpos[model.jnt_qposadr[joints]] = q
        data.qpos[model.jnt_qposadr[finger_joints]] = closed + opening * (opened - closed)
        mujoco.mj_kinematics(model, data)
        poses: FloatArray = T @ se3.make(data.geom_xmat[numbers].reshape(-1, 3, 3), data.geom_xpos[numbers])
        return poses

    solids = [[_solid(model, geom, body_margin) for geom in geoms] for body_margin, geoms in bodies]
    return SelfFilter(len(joints), solids, geom_poses)


def _joint(model: mujoco.MjModel, name: str) -> int:
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)
    if index < 0:
        names = ", ".join(model.joint(i).name for i in range(model.njnt))
        raise InvalidInput("joint_names", f"no joint {name!r}", names)
    return int(index)


def _finger_margins(model: mujoco.MjModel, joints: Sequence[int], margin: float) -> dict[str, float]:
    """The margin of all bodies that some joints move."""
    moved: set[int] = {int(model.jnt_bodyid[joint]) for joint in joints}
    for body in range(model.nbody):  # parents come first
        if int(model.body_parentid[body]) in moved:
            moved.add(body)
    return {model.body(body).name: margin for body in moved}


def _bodies(model: mujoco.MjModel, root: int, margins: Mapping[str, float]) -> list[tuple[float, list[int]]]:
    """Margin and geoms of each body of the tree under `root` that has geoms."""
    bodies = [i for i in range(model.nbody) if model.body_rootid[i] == root]
    names = {model.body(i).name for i in bodies}
    if unknown := sorted(set(margins) - names - {""}):
        raise InvalidInput("margin", f"no body {unknown[0]!r}", ", ".join(sorted(names)))
    found = []
    for body in bodies:
        margin = margins.get(model.body(body).name, margins.get("", 0.0))
        if len(geoms := np.flatnonzero(model.geom_bodyid == body)):
            found.append((margin, geoms.tolist()))
    return found


def _solid(model: mujoco.MjModel, geom: int, margin: float) -> Solid:
    kind, radius = int(model.geom_type[geom]), float(model.geom_rbound[geom])
    if kind in _ANALYTIC:
        return Solid(_ANALYTIC[kind], model.geom_size[geom].copy(), radius, margin)
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = int(model.geom_dataid[geom])
        start, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
        planes = primitives.half_spaces(model.mesh_vert[start : start + count].astype(np.float64))
        return Solid(primitives.convex, planes, radius, margin)
    name = mujoco.mjtGeom(kind).name
    raise InvalidInput(
        "model", f"geom {geom} is a {name}", "sphere, capsule, cylinder, box, ellipsoid or mesh"
    )
