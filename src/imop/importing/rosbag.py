"""Bags of ROS 2 (folders, or single MCAP and SQLite files) and of ROS 1, read without ROS.

Colour and depth images, camera_info, tf and joint_states tell everything, if the bag has them: intrinsics,
where cameras and gripper are, joints and fingers. Images are read when they are asked for.
"""

from collections import defaultdict
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from imop.errors import CorruptData, ImopError, InvalidInput
from imop.extras import extra
from imop.geometry import se3
from imop.importing.episode import Episode, Images, complete_cameras, kinematic_poses, opening_of
from imop.importing.ros_images import COLORS, DEPTHS, SCALES, color_of, depth_of, encoding
from imop.importing.side import Side, SideCamera
from imop.importing.tf import TransformTree
from imop.recording.folder import RecordedCamera
from imop.recording.motion import Motion
from imop.types import FloatArray

IMAGES = ("sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage")
INFO, TF, JOINTS = "sensor_msgs/msg/CameraInfo", "tf2_msgs/msg/TFMessage", "sensor_msgs/msg/JointState"
FINGERS = {"panda_finger_joint1": (0.0, 0.04), "fr3_finger_joint1": (0.0, 0.04)}
"""Fingers that need no side file."""
TIPS = ("panda_hand_tcp", "fr3_hand_tcp")
"""Frames that are imop's gripper frame and need no side file."""
TOGETHER = 0.05
"""Seconds by which images of one frame may differ."""
STRAIGHT = 1e-3
"""Coefficients of distortion below this are none."""
_REMEDY = "record it again, or repair it: ros2 bag reindex"


@dataclass(eq=False)
class _Images:
    """Of one topic: what it has, and when."""

    kind: str
    frame: str
    stamps: list[float] = field(default_factory=list)
    received: list[int] = field(default_factory=list)


@dataclass(eq=False)
class Contents:
    """What is in a bag but the images themselves."""

    images: dict[str, _Images] = field(default_factory=dict)
    infos: dict[str, Any] = field(default_factory=dict)
    tree: TransformTree = field(default_factory=TransformTree)
    joints: dict[str, dict[float, float]] = field(default_factory=lambda: defaultdict(dict))


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    with extra("import"):
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    try:
        with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            yield reader
    except ImopError:
        raise
    except FileNotFoundError as error:
        raise CorruptData(path, "there is no bag", "give the folder of a bag, or an .mcap file") from error
    except Exception as error:  # a damaged bag can fail in any way at all
        raise CorruptData(
            path, f"cannot be read as a bag ({type(error).__name__}: {error})", _REMEDY
        ) from error


def read_contents(path: Path) -> Contents:
    """Go through a bag once.

    Raises:
        CorruptData: if it is none, or damaged.
        MissingExtra: without rosbags.
    """
    found = Contents()
    with _opened(path) as reader:
        wanted = [c for c in reader.connections if c.msgtype in (*IMAGES, INFO, TF, JOINTS)]
        if not wanted:
            types = ", ".join(sorted({c.msgtype for c in reader.connections})) or "nothing"
            raise CorruptData(path, f"has no images, tf or joint_states, but {types}", "record them")
        for connection, received, raw in reader.messages(connections=wanted):
            _take(found, connection, received, reader.deserialize(raw, connection.msgtype))
    return found


def _take(found: Contents, connection: Any, received: int, message: Any) -> None:
    topic, kind = connection.topic, connection.msgtype
    if kind == TF:
        for one in message.transforms:
            T, static = _transform(one.transform), topic.endswith("tf_static")
            found.tree.add(one.header.frame_id, one.child_frame_id, _stamp(one.header, received), T, static)
    elif kind == JOINTS:
        stamp = _stamp(message.header, received)
        for name, position in zip(message.name, message.position, strict=False):
            found.joints[str(name)][stamp] = float(position)
    elif kind == INFO:
        found.infos.setdefault(topic, message)
    else:
        frame = message.header.frame_id.lstrip("/")
        images = found.images.setdefault(topic, _Images(encoding(message), frame))
        images.stamps.append(_stamp(message.header, received))
        images.received.append(received)


def _stamp(header: Any, received: int) -> float:
    """Seconds; when it was received, if nobody stamped it."""
    stamp = header.stamp.sec + header.stamp.nanosec * 1e-9
    return float(stamp) if stamp > 0 else received * 1e-9


def _transform(transform: Any) -> FloatArray:
    p, q = transform.translation, transform.rotation
    return se3.from_pose7(np.array([p.x, p.y, p.z, q.x, q.y, q.z, q.w]))


def read_bag(path: Path, side: Side) -> Episode:
    """One bag is one episode.

    Frames are those of the first camera's colours at which everything else is known, too.

    Raises:
        CorruptData: if the bag cannot be read.
        InvalidInput: for the first thing that neither the bag nor the side file nor the set-up says.
        MissingExtra: without rosbags.
    """
    found = read_contents(path)
    if not side.frame and side.setup is None:
        side = replace(side, frame=next((tip for tip in TIPS if tip in found.tree.frames), ""))
    named = _cameras(found, side)
    world = _world(found, side)
    recorded = {}
    for name, camera in named.items():
        placed = _placed(found, side, name, camera, world)
        K = _intrinsics(found, side, name, camera)
        recorded[name] = RecordedCamera(K, SCALES[found.images[camera.depth].kind], *placed)
    cameras = complete_cameras(side, recorded)
    rows, stamps = _frames(found, side, named, world)
    motion = _motion(found, side, world, stamps)

    def look(camera: str, frame: int) -> Images:
        topics = named[camera]
        with _opened(path) as reader:
            color = _message(reader, found, topics.rgb, rows[topics.rgb][frame])
            depth = _message(reader, found, topics.depth, rows[topics.depth][frame])
        return color_of(color, f"{path}, {topics.rgb}"), depth_of(depth, f"{path}, {topics.depth}")

    return Episode(str(path), motion, cameras, look, f"rosbag/{path.stem}")


def _message(reader: Any, found: Contents, topic: str, row: int) -> Any:
    connections = [c for c in reader.connections if c.topic == topic]
    received = found.images[topic].received[row]
    # Messages may have been received at the same time.
    number = row - found.images[topic].received.index(received)
    messages = reader.messages(connections=connections, start=received, stop=received + 1)
    for k, (connection, _, raw) in enumerate(messages):
        if k == number:
            return reader.deserialize(raw, connection.msgtype)
    raise CorruptData(topic, f"message {row} is gone", _REMEDY)


def _cameras(found: Contents, side: Side) -> dict[str, SideCamera]:
    """Camera -> its topics, by the side file, or else by their names."""
    colors = [topic for topic, images in found.images.items() if images.kind in COLORS]
    depths = [topic for topic, images in found.images.items() if images.kind in DEPTHS]
    if side.chooses:
        for name, camera in side.cameras.items():
            for kind, topic, there in (("rgb", camera.rgb, colors), ("depth", camera.depth, depths)):
                if topic not in there:
                    problem = f"no such images in {topic}" if topic else "missing"
                    raise InvalidInput(f"cameras.{name}.{kind}", problem, _listed(there))
        return dict(side.cameras)
    if not colors or not depths:
        lacking, what = ("depth", "depth (16UC1 or 32FC1)") if colors else ("rgb", "colours")
        accepted = f"a topic of {what}; images are in: {_listed(found.images)}"
        raise InvalidInput(f"cameras.NAME.{lacking}", "there is none in the bag", accepted)
    pairs = {}
    for color in colors:
        mine = [depth for depth in depths if _namespace(depth) == _namespace(color)]
        # A depth that is aligned has the pixels of the colours.
        aligned = [depth for depth in mine if "aligned" in depth or "registered" in depth] or mine
        if len(colors) == len(depths) == 1:
            aligned = depths
        if len(aligned) != 1:
            accepted = f"[cameras.NAME] with rgb and depth in a side file, of {_listed([*colors, *depths])}"
            raise InvalidInput("cameras", f"the depth of {color} is not clear", accepted)
        pairs[_namespace(color) or "camera"] = SideCamera(color, aligned[0])
    side.require_names(pairs)
    return pairs


def _namespace(topic: str) -> str:
    """What stands before the words that drivers of cameras use: front of /front/color/image_raw."""
    usual = {"color", "rgb", "depth", "image", "image_raw", "image_rect", "image_rect_color", "image_color"}
    usual |= {"aligned_depth_to_color", "depth_registered", "compressed", "compressedDepth", "image_rect_raw"}
    return "_".join(dict.fromkeys(part for part in topic.strip("/").split("/") if part not in usual))


def _listed(names: Any) -> str:
    return ", ".join(names) or "there is none"


def _world(found: Contents, side: Side) -> str:
    if side.world:
        if side.world not in found.tree.frames:
            raise InvalidInput("world", f"no tf frame {side.world!r}", _listed(found.tree.frames))
        return side.world
    roots = found.tree.roots
    if len(roots) > 1:
        raise InvalidInput(
            "world", f"tf has {len(roots)} roots", f"a tf frame, such as one of {_listed(roots)}"
        )
    return roots[0] if roots else ""


def _placed(
    found: Contents, side: Side, name: str, camera: SideCamera, world: str
) -> tuple[FloatArray | None, FloatArray | None]:
    """By tf: T_world_camera of a camera that stands, or T_gripper_camera of one on the gripper."""
    tree, frame = found.tree, camera.frame or found.images[camera.rgb].frame
    if camera.frame and frame not in tree.frames:
        raise InvalidInput(f"cameras.{name}.frame", f"no tf frame {frame!r}", _listed(tree.frames))
    known = side.cameras[name].known if name in side.cameras else RecordedCamera()
    given = known.T_world_camera is not None or known.T_gripper_camera is not None
    if given or not world or frame not in tree.frames or not tree.connects(world, frame):
        return None, None
    now = np.zeros(1)
    if not tree.moves(world, frame):
        return tree.lookup(world, frame, now)[0], None
    if not side.frame or not tree.connects(side.frame, frame) or tree.moves(side.frame, frame):
        problem = f"{frame} moves in {world}, and not with gripper.frame"
        accepted = f"a tf frame of the gripper that {frame} is fixed to; or T_gripper_camera"
        raise InvalidInput(f"cameras.{name}.T_gripper_camera", problem, accepted)
    return None, se3.invert(side.T_frame_gripper) @ tree.lookup(side.frame, frame, now)[0]


def _intrinsics(found: Contents, side: Side, name: str, camera: SideCamera) -> FloatArray | None:
    """By the camera_info that stands beside the colours, unless the side file says them."""
    if name in side.cameras and side.cameras[name].known.intrinsics is not None:
        return None
    topic = camera.info or _beside(camera.rgb, found.infos)
    if topic not in found.infos:
        if camera.info:
            raise InvalidInput(f"cameras.{name}.info", f"no topic {topic}", _listed(found.infos))
        return None
    info = found.infos[topic]
    distortion = np.asarray(info.d if hasattr(info, "d") else info.D, dtype=np.float64)
    K = np.asarray(info.k if hasattr(info, "k") else info.K, dtype=np.float64).reshape(3, 3)
    if np.abs(distortion).max(initial=0.0) > STRAIGHT and "rect" not in camera.rgb:
        problem = f"{topic} says that images are distorted, {np.round(distortion, 4).tolist()}"
        accepted = (
            "rectified images (image_rect), or intrinsics in the side file, if the distortion is nothing"
        )
        raise InvalidInput(f"cameras.{name}.intrinsics", problem, accepted)
    return K if K[0, 0] > 0 else None


def _beside(topic: str, infos: Mapping[str, Any]) -> str:
    """The camera_info in the namespace of images, which may be a level up if they are compressed."""
    for level in (topic.rsplit("/", 1)[0], topic.rsplit("/", 2)[0]):
        if f"{level}/camera_info" in infos:
            return f"{level}/camera_info"
    return ""


def _frames(
    found: Contents, side: Side, cameras: Mapping[str, SideCamera], world: str
) -> tuple[dict[str, list[int]], FloatArray]:
    """Of every topic the message of each frame, and the frames' stamps."""
    first = next(iter(cameras.values())).rgb
    stamps = np.array(found.images[first].stamps)
    _, unique = np.unique(stamps, return_index=True)
    rows = {first: unique}
    usable = np.ones(len(unique), dtype=bool)
    for topic in {t for camera in cameras.values() for t in (camera.rgb, camera.depth)} - {first}:
        others = np.array(found.images[topic].stamps)
        nearest = np.abs(others[None] - stamps[unique][:, None]).argmin(axis=1)
        rows[topic] = nearest
        usable &= np.abs(others[nearest] - stamps[unique]) <= TOGETHER
    if not usable.any():
        problem = f"images of {_listed(rows)} are nowhere within {TOGETHER} s of each other"
        raise InvalidInput("cameras", problem, "cameras with one clock")
    begin, end = _state_span(found, side, world)
    usable &= (stamps[unique] >= begin - TOGETHER) & (stamps[unique] <= end + TOGETHER)
    if usable.sum() < 2:
        problem = (
            f"none of {first} is from between {begin:.3f} and {end:.3f} s, of which the arm's state is known"
        )
        raise InvalidInput("joint_states", problem, "an arm and cameras with one clock")
    return {topic: found_rows[usable].tolist() for topic, found_rows in rows.items()}, stamps[unique][usable]


def _state_span(found: Contents, side: Side, world: str) -> tuple[float, float]:
    spans = [
        (min(found.joints[n]), max(found.joints[n]))
        for n in _joints(found, side) + list(_fingers(found, side))
    ]
    if side.frame and world and side.frame in found.tree.frames and found.tree.connects(world, side.frame):
        spans.append(found.tree.span(world, side.frame))
    return max(begin for begin, _ in spans), min(end for _, end in spans)


def _fingers(found: Contents, side: Side) -> dict[str, tuple[float, float]]:
    fingers = dict(side.fingers) or {n: r for n, r in FINGERS.items() if n in found.joints}
    for name in fingers:
        if name not in found.joints:
            raise InvalidInput(f"gripper.fingers.{name}", "not in joint_states", _listed(found.joints))
    if not fingers:
        accepted = (
            f"{{NAME = [closed, open]}}, positions of finger joints; joint_states has {_listed(found.joints)}"
        )
        raise InvalidInput("gripper.fingers", "missing", accepted)
    return fingers


def _joints(found: Contents, side: Side) -> list[str]:
    if side.joints:
        for number, name in enumerate(side.joints):
            if name not in found.joints:
                raise InvalidInput(
                    f"joints[{number}]", f"{name!r} is not in joint_states", _listed(found.joints)
                )
        return list(side.joints)
    fingers = {n for n in found.joints if n in side.fingers or "finger" in n}
    names = sorted(set(found.joints) - fingers)
    # Some drivers sort joints by name, which says nothing about their order unless they are numbered.
    if names and all(name[-1].isdigit() for name in names) and len({name[:-1] for name in names}) == 1:
        return names
    accepted = f"names of the arm's joints from base to hand, of {_listed(found.joints)}"
    raise InvalidInput("joints", "their order is not clear", accepted)


def _motion(found: Contents, side: Side, world: str, stamps: FloatArray) -> Motion:
    names, fingers = _joints(found, side), _fingers(found, side)
    q = np.stack([_interpolated(found.joints[name], stamps) for name in names], axis=1)
    q = np.radians(q) if side.degrees else q
    opening = opening_of({name: _interpolated(found.joints[name], stamps) for name in fingers}, fingers)
    tree = found.tree
    if side.frame:
        if side.frame not in tree.frames or not tree.connects(world, side.frame):
            problem = f"tf does not lead from {world or 'a world'} to {side.frame!r}"
            raise InvalidInput("gripper.frame", problem, _listed(tree.frames))
        poses = tree.lookup(world, side.frame, stamps) @ side.T_frame_gripper
    else:
        accepted = f"the tf frame between the finger tips, of {_listed(tree.frames)}"
        poses = kinematic_poses(side, q, "gripper.frame", accepted)
    return Motion(stamps, np.asarray(poses), opening, q)


def _interpolated(told: Mapping[float, float], stamps: FloatArray) -> FloatArray:
    times = np.array(sorted(told))
    return np.asarray(np.interp(stamps, times, np.array([told[time] for time in times.tolist()])))
