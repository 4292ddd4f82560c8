"""A small analytic world for tests: boxes on a table, seen by ray-casting cameras; a gripper lifts one.

No simulator is involved, so what every pixel must be is known exactly.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from imop.geometry import se3
from imop.robots.panda import PANDA_HOME_Q, tip_pose
from imop.types import Action, CameraView, Demonstration, Keyframe, Observation

TABLE_HEIGHT = 0.75
TABLE_ID = 1
HAND_ID = 2
FINGER_ID = 3
FOCAL = 175.8386
SIZE = 128
INTRINSICS = np.array([[FOCAL, 0, 64], [0, FOCAL, 64], [0, 0, 1]])
WRIST_INTRINSICS = np.array([[110.8512, 0, 64], [0, 110.8512, 64], [0, 0, 1]])
NAMES = {TABLE_ID: "table", HAND_ID: "hand", FINGER_ID: "fingers", 10: "cube", 11: "block", 12: "plate"}


@dataclass(frozen=True)
class Box:
    T_world_box: np.ndarray
    half_size: tuple[float, float, float]
    color: tuple[int, int, int]
    id: int


def look_at(position, target, up=(0.0, 0.0, 1.0)) -> np.ndarray:
    """T_world_camera (x right, y down, z forward) of a camera at `position` that looks at `target`."""
    z = np.subtract(target, position)
    z = z / np.linalg.norm(z)
    x = np.cross(z, up)
    x = x / np.linalg.norm(x)
    return se3.make(np.stack([x, np.cross(z, x), z], axis=1), np.asarray(position, dtype=float))


TABLE_CENTRE = (0.25, 0.0, 0.8)
CAMERAS: Mapping[str, np.ndarray] = {
    "front": look_at((1.35, 0.0, 1.58), TABLE_CENTRE),
    "left_shoulder": look_at((-0.175, 0.6, 1.7), TABLE_CENTRE),
}
SYNTHETIC_CAMERAS = (*CAMERAS, "wrist")
# In the gripper's frame: beside the hand, looking at the tip.
T_GRIPPER_WRIST = se3.make(se3.euler(y=0.6) @ se3.euler(z=0.3), (-0.09, 0.0, -0.09))


def render(boxes: Sequence[Box], T_world_camera, intrinsics=INTRINSICS, size=SIZE) -> CameraView:
    """What a camera sees of the table (id 1) and the boxes; depth 0 where a ray meets neither."""
    u, v = np.meshgrid(np.arange(size), np.arange(size))
    rays = np.stack([u, v, np.ones_like(u)], axis=-1).reshape(-1, 3) @ np.linalg.inv(intrinsics).T
    origin, directions = T_world_camera[:3, 3], rays @ T_world_camera[:3, :3].T
    depth = np.full(len(rays), np.inf)
    ids, colors = np.zeros(len(rays), np.int32), np.zeros((len(rays), 3), np.uint8)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (TABLE_HEIGHT - origin[2]) / directions[:, 2]
    p = origin + np.where(np.isfinite(t), t, 0)[:, None] * directions
    hit = (t > 0) & (np.abs(p[:, 0] - 0.3) < 0.8) & (np.abs(p[:, 1]) < 0.56)
    depth[hit], ids[hit] = t[hit], TABLE_ID
    checks = (np.floor(p[:, 0] / 0.1) + np.floor(p[:, 1] / 0.1)) % 2 == 0
    colors[hit] = np.where(checks[:, None], (204, 166, 90), (184, 146, 80))[hit]
    for box in boxes:
        T_box_world = se3.invert(box.T_world_box)
        o, d = se3.apply(T_box_world, origin[None])[0], se3.rotate(T_box_world, directions)
        with np.errstate(divide="ignore", invalid="ignore"):
            t0, t1 = (-np.array(box.half_size) - o) / d, (np.array(box.half_size) - o) / d
        entry = np.minimum(t0, t1)
        t = entry.max(axis=1)
        hit = (t > 0) & (t <= np.maximum(t0, t1).min(axis=1)) & (t < depth)
        # Every face has its own brightness.
        shade = np.array([0.7, 0.85, 1.0])[entry.argmax(axis=1)]
        depth[hit], ids[hit] = t[hit], box.id
        colors[hit] = (shade[:, None] * box.color).astype(np.uint8)[hit]
    image = (size, size)
    depth = np.where(np.isfinite(depth), depth, 0.0).astype(np.float32).reshape(image)
    return CameraView(colors.reshape(*image, 3), depth, intrinsics, T_world_camera, ids.reshape(image))


def gripper_boxes(T_world_gripper, opening: float) -> list[Box]:
    """A hand and two fingers."""
    half = 0.04 * opening
    hand = Box(T_world_gripper @ se3.make(p=(0, 0, -0.09)), (0.03, 0.1, 0.04), (230, 230, 230), HAND_ID)
    fingers = [
        Box(T_world_gripper @ se3.make(p=(0, y, -0.025)), (0.01, 0.008, 0.025), (60, 60, 60), FINGER_ID)
        for y in (half + 0.008, -half - 0.008)
    ]
    return [hand, *fingers]


def observe(boxes, T_world_gripper, opening, time_step=0, cameras=CAMERAS, wrist=True, q=None) -> Observation:
    """The scene with the gripper in it, by all `cameras` and one on the hand."""
    poses = dict(cameras)
    if wrist:
        poses["wrist"] = T_world_gripper @ T_GRIPPER_WRIST
    everything = [*boxes, *gripper_boxes(T_world_gripper, opening)]
    return Observation(
        views={
            name: render(everything, T, WRIST_INTRINSICS if name == "wrist" else INTRINSICS)
            for name, T in poses.items()
        },
        T_world_gripper=T_world_gripper,
        gripper_opening=opening,
        time_step=time_step,
        joint_positions=q,
        joint_velocities=None if q is None else np.zeros(7),
        instance_names=NAMES,
    )


def joints_for(T_world_gripper) -> np.ndarray:
    """Joint positions of the Panda at which its tip is at `T_world_gripper`."""

    def miss(q):
        T = se3.invert(tip_pose(q)) @ T_world_gripper
        return np.concatenate([T[:3, 3], 0.3 * Rotation.from_matrix(T[:3, :3]).as_rotvec()])

    found = least_squares(miss, PANDA_HOME_Q + np.array([0, 0.3, 0, -1.0, 0, 0.7, 0]), xtol=1e-12, ftol=1e-12)
    assert np.abs(found.fun).max() < 1e-6
    return found.x


@cache
def lift_a_cube() -> Demonstration:
    """Above the cube; grasp it; lift it. Three steps, four observations, privileged fields filled."""
    down = Rotation.from_euler("xyz", [np.pi - 0.1, 0.05, 0.4]).as_matrix()
    T_cube = se3.make(se3.euler(z=0.4), (0.30, 0.10, TABLE_HEIGHT + 0.025))
    cube = Box(T_cube, (0.025, 0.025, 0.025), (200, 30, 30), 10)
    others = [
        Box(se3.make(se3.euler(z=-0.3), (0.15, -0.15, 0.80)), (0.06, 0.04, 0.05), (30, 60, 200), 11),
        Box(se3.make(se3.euler(z=1.0), (0.42, -0.05, 0.765)), (0.08, 0.05, 0.015), (40, 160, 60), 12),
    ]
    grasp = se3.make(down, T_cube[:3, 3] + (0, 0, 0.005))
    above, lifted = se3.make(p=(0, 0, 0.12)) @ grasp, se3.make(p=(-0.05, -0.05, 0.2)) @ grasp
    home = se3.make(se3.euler(z=0.3) @ down, (0.28, 0.0, 1.2))
    carried = replace(cube, T_world_box=lifted @ se3.invert(grasp) @ T_cube)
    seen = [
        observe([cube, *others], home, 1.0, 0, q=joints_for(home)),
        observe([cube, *others], above, 1.0, 1, q=joints_for(above)),
        observe([cube, *others], grasp, 0.63, 2, q=joints_for(grasp)),
        observe([carried, *others], lifted, 0.63, 3, q=joints_for(lifted)),
    ]
    actions = [Action(above, True), Action(grasp, False), Action(lifted, False, allow_collisions=True)]
    keyframes = tuple(
        Keyframe(o, action, "cube", T_cube) for o, action in zip(seen[:-1], actions, strict=True)
    )
    instructions = ("lift the red cube", "pick the cube up: nehmt den Würfel")
    return Demonstration(keyframes, seen[-1], "test/lift", 2, instructions, {"instance": 7, "episode": 11})


def with_views(demonstration: Demonstration, change) -> Demonstration:
    """`demonstration` with every view replaced by change(step, camera name, view)."""
    return with_observations(
        demonstration,
        lambda k, o: replace(o, views={n: change(k, n, v) for n, v in o.views.items()}),
    )


def with_observations(demonstration: Demonstration, change) -> Demonstration:
    """`demonstration` with every observation replaced by change(step, observation)."""
    keyframes = tuple(
        replace(keyframe, observation=change(k, keyframe.observation))
        for k, keyframe in enumerate(demonstration.keyframes)
    )
    return replace(demonstration, keyframes=keyframes, final=change(len(keyframes), demonstration.final))


def assert_same(a: Demonstration, b: Demonstration) -> None:
    """Every field is equal, arrays bit by bit."""
    _assert_same(a, b, "demonstration")


def _assert_same(a, b, where) -> None:
    assert type(a) is type(b), where
    if isinstance(a, np.ndarray):
        assert a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes(), where
    elif hasattr(a, "__dataclass_fields__"):
        for name in a.__dataclass_fields__:
            _assert_same(getattr(a, name), getattr(b, name), f"{where}.{name}")
    elif isinstance(a, dict):
        assert list(a) == list(b), where
        for key in a:
            _assert_same(a[key], b[key], f"{where}[{key!r}]")
    elif isinstance(a, tuple):
        assert len(a) == len(b), where
        for i, (x, y) in enumerate(zip(a, b, strict=True)):
            _assert_same(x, y, f"{where}[{i}]")
    else:
        assert a == b, where
