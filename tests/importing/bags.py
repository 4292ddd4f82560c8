"""A bag of ROS as rosbags writes it: the take of `tests/recording/takes.py` with frames and topics."""

import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from imop.geometry import se3
from tests.recording import takes

STORE = get_typestore(Stores.ROS2_HUMBLE)
T_HAND_TIP = se3.make(p=(0, 0, 0.1034))
JOINTS = [f"panda_joint{i}" for i in range(1, 8)]
RGB, DEPTH = "/front/color/image_raw", "/front/aligned_depth_to_color/image_raw"
INFO = "/front/color/camera_info"


def kind(name):
    return STORE.types[name]


def header(stamp, frame=""):
    seconds = int(stamp)
    time = kind("builtin_interfaces/msg/Time")(seconds, round((stamp - seconds) * 1e9))
    return kind("std_msgs/msg/Header")(time, frame)


def transform(parent, child, stamp, T):
    p, q = np.split(se3.to_pose7(T), [3])
    told = kind("geometry_msgs/msg/Transform")(
        kind("geometry_msgs/msg/Vector3")(*p), kind("geometry_msgs/msg/Quaternion")(*q)
    )
    stamped = kind("geometry_msgs/msg/TransformStamped")(header(stamp, parent), child, told)
    return kind("tf2_msgs/msg/TFMessage")([stamped])


def image(stamp, pixels, encoding):
    data = np.ascontiguousarray(pixels)
    height, width = pixels.shape[:2]
    return kind("sensor_msgs/msg/Image")(
        header(stamp, "front_optical"),
        height,
        width,
        encoding,
        0,
        data.strides[0],
        data.view(np.uint8).ravel(),
    )


def camera_info(stamp, distortion):
    roi = kind("sensor_msgs/msg/RegionOfInterest")(0, 0, 0, 0, False)
    P = np.hstack([takes.K, np.zeros((3, 1))])
    width, height = takes.SIZE
    return kind("sensor_msgs/msg/CameraInfo")(
        header(stamp, "front_optical"), height, width, "plumb_bob", np.array(distortion, float),
        takes.K.ravel(), np.eye(3).ravel(), P.ravel(), 0, 0, roi,
    )  # fmt: skip


def joint_state(stamp, names, positions):
    empty = np.zeros(0)
    return kind("sensor_msgs/msg/JointState")(header(stamp), names, np.array(positions, float), empty, empty)


def messages(depth="16UC1", distortion=(0.0,) * 5, tip="panda_hand_tcp"):
    """(topic, stamp, message) of everything that a complete bag has; the world is called map."""
    yield "/tf_static", 99.0, transform("map", "panda_link0", 99.0, takes.T_WORLD_BASE)
    yield "/tf_static", 99.0, transform("panda_hand", tip, 99.0, T_HAND_TIP)
    yield (
        "/tf_static",
        99.0,
        transform("map", "front_link", 99.0, takes.T_WORLD_FRONT @ se3.make(p=(0.1, 0, 0))),
    )
    yield "/tf_static", 99.0, transform("front_link", "front_optical", 99.0, se3.make(p=(-0.1, 0, 0)))
    yield INFO, 99.0, camera_info(99.0, distortion)
    # The arm tells its state more often than cameras see, and the gripper has a driver of its own.
    for state in takes.moments(60.0):
        T_base_hand = state.T_base_gripper @ se3.invert(T_HAND_TIP)
        yield "/tf", state.stamp, transform("panda_link0", "panda_hand", state.stamp, T_base_hand)
        yield "/joint_states", state.stamp, joint_state(state.stamp, JOINTS, state.joint_positions)
        fingers = [0.04 * state.gripper_opening] * 2
        names = ["panda_finger_joint1", "panda_finger_joint2"]
        yield "/franka_gripper/joint_states", state.stamp, joint_state(state.stamp, names, fingers)
    for number, state in enumerate(takes.moments()):
        frame = takes.frames(number)["front"]
        yield RGB, state.stamp, image(state.stamp, frame.rgb[:, :, ::-1], "bgr8")
        metres = frame.depth.astype(np.float32)
        pixels = metres if depth == "32FC1" else np.round(1000 * metres).astype(np.uint16)
        yield DEPTH, state.stamp + 0.004, image(state.stamp + 0.004, pixels, depth)


def write(path, everything, plugin=StoragePlugin.MCAP, leave_out=()):
    """Write messages as a bag, but for those of some topics."""
    with Writer(path, version=9, storage_plugin=plugin) as bag:
        connections = {}
        for topic, stamp, message in sorted(everything, key=lambda one: one[1]):
            if topic in leave_out:
                continue
            name = message.__msgtype__
            if topic not in connections:
                connections[topic] = bag.add_connection(topic, name, typestore=STORE)
            bag.write(connections[topic], round(stamp * 1e9), STORE.serialize_cdr(message, name))
    return path
