"""An arm behind ROS 2 and MoveIt 2, and a camera behind ROS 2, as a robot and a camera of imop.

This is an example to be adapted: it was checked against the interfaces' definitions and not run on a robot.
It needs a sourced ROS 2 (Humble or later) with moveit_msgs, control_msgs, sensor_msgs and tf2_ros, and imop
in the same Python. MoveIt plans around what its planning scene holds, so its motions may be free.

    from examples.ros2_bridge import MoveItRobot, RosCamera

    robot = MoveItRobot("manipulator", "base_link", tip="imop_gripper", gripper="gripper",
                        joints=("joint1", ...), stroke=0.085)
    cameras = {"front": RosCamera("/camera/color/image_raw", "/camera/aligned_depth_to_color/image_raw",
                                  "/camera/color/camera_info")}

`tip` is a frame of tf: publish it with static_transform_publisher from the flange, by the table [gripper] of
the set-up (`Setup.gripper.T_flange_gripper`). Put the robot into `imop.robots.guarded.GuardedRobot`.
"""

import threading
import time

import numpy as np
import rclpy
from control_msgs.action import GripperCommand
from geometry_msgs.msg import PoseStamped
from moveit_msgs.action import MoveGroup
from moveit_msgs.msg import Constraints, MoveItErrorCodes, OrientationConstraint, PositionConstraint
from rclpy.action import ActionClient
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rclpy.time import Time
from sensor_msgs.msg import CameraInfo, Image, JointState
from shape_msgs.msg import SolidPrimitive
from tf2_ros import Buffer, TransformException, TransformListener

from imop.cameras.interfaces import Frame
from imop.geometry import se3
from imop.robots.interfaces import DONE, MotionResult, RobotState

PATIENCE = 60.0
"""Seconds in which an action has to end."""
POLL = 0.02


def start(name: str) -> Node:
    """A node whose callbacks run in a thread of their own."""
    if not rclpy.ok():
        rclpy.init()
    node = Node(name)
    executor = MultiThreadedExecutor(num_threads=2)
    executor.add_node(node)
    threading.Thread(target=executor.spin, daemon=True).start()
    return node


class MoveItRobot:
    """MoveIt's move group as an `imop.robots.interfaces.Robot`."""

    def __init__(self, group: str, base: str, tip: str, gripper: str, joints: tuple[str, ...], stroke: float):
        self._group, self._base, self._tip, self._joints, self._stroke = group, base, tip, joints, stroke
        self._node, self._stop = start("imop_robot"), threading.Event()
        self._buffer = Buffer()
        self._listener = TransformListener(self._buffer, self._node)
        together = ReentrantCallbackGroup()
        self._move = ActionClient(self._node, MoveGroup, "/move_action", callback_group=together)
        command = f"/{gripper}_controller/gripper_cmd"
        self._grip = ActionClient(self._node, GripperCommand, command, callback_group=together)
        self._positions: dict[str, float] = {}
        self._opening = 1.0
        self._node.create_subscription(JointState, "/joint_states", self._heard, 10)
        for client in (self._move, self._grip):
            if not client.wait_for_server(timeout_sec=10.0):
                raise ConnectionError("an action server of MoveIt or of the gripper is not there")

    def state(self) -> RobotState:
        """As `Robot.state`, from tf and the joint states."""
        try:
            found = self._buffer.lookup_transform(self._base, self._tip, Time())
        except TransformException as error:
            raise ConnectionError(f"tf: {error}") from error
        if not set(self._joints) <= set(self._positions):
            raise ConnectionError("no joint states")
        p, q = found.transform.translation, found.transform.rotation
        T = se3.from_pose7(np.array([p.x, p.y, p.z, q.x, q.y, q.z, q.w]))
        stamp = found.header.stamp.sec + 1e-9 * found.header.stamp.nanosec
        return RobotState(T, self._opening, np.array([self._positions[j] for j in self._joints]), stamp)

    def move_to(self, T_base_gripper, *, straight=False, allow_collisions=False) -> MotionResult:
        """As `Robot.move_to`, as MoveIt plans it; lines by the Pilz planner."""
        # That the arm may touch something MoveIt has to be told in its planning scene.
        goal = MoveGroup.Goal()
        request = goal.request
        request.group_name, request.num_planning_attempts, request.allowed_planning_time = self._group, 5, 5.0
        request.max_velocity_scaling_factor = request.max_acceleration_scaling_factor = 0.1
        if straight:
            request.pipeline_id, request.planner_id = "pilz_industrial_motion_planner", "LIN"
        request.goal_constraints = [self._constraints(np.asarray(T_base_gripper))]
        self._stop.clear()
        result = self._wait(self._move, goal)
        if isinstance(result, MotionResult):
            return result
        code = result.error_code.val
        if code == MoveItErrorCodes.SUCCESS:
            return DONE
        reasons = {
            MoveItErrorCodes.NO_IK_SOLUTION: "unreachable",
            MoveItErrorCodes.GOAL_IN_COLLISION: "goal_in_collision",
            MoveItErrorCodes.START_STATE_IN_COLLISION: "start_in_collision",
            MoveItErrorCodes.PLANNING_FAILED: "no_path",
            MoveItErrorCodes.PREEMPTED: "stopped",
            MoveItErrorCodes.CONTROL_FAILED: "protective_stop",
        }
        return MotionResult(False, reasons.get(code, "not_arrived"), f"MoveIt's error code {code}")

    def move_gripper(self, opening: float) -> MotionResult:
        """As `Robot.move_gripper`."""
        goal = GripperCommand.Goal()
        goal.command.position, goal.command.max_effort = opening * self._stroke, 20.0
        self._stop.clear()
        result = self._wait(self._grip, goal)
        if isinstance(result, MotionResult):
            return result
        # What is held stops the fingers, which is no failure.
        self._opening = float(np.clip(result.position / self._stroke, 0.0, 1.0))
        return DONE

    def stop(self) -> None:
        """As `Robot.stop`; the action is cancelled."""
        self._stop.set()

    def recover(self) -> MotionResult:
        """As `Robot.recover`; to be written for your driver."""
        # Drivers have services of their own for this, such as franka_ros2's error_recovery action or the
        # dashboard services of ur_robot_driver; call yours here.
        return DONE

    def _heard(self, states: JointState) -> None:
        self._positions.update(zip(states.name, states.position, strict=True))

    def _wait(self, client: ActionClient, goal):
        """The action's result, or why there is none."""
        sent = client.send_goal_async(goal)
        if not self._until(sent.done):
            return MotionResult(False, "disconnected", "the goal was not answered")
        handle = sent.result()
        if not handle.accepted:
            return MotionResult(False, "not_ready", "the goal was refused")
        ended = handle.get_result_async()
        self._until(lambda: ended.done() or self._stop.is_set())
        if not ended.done():
            handle.cancel_goal_async()
            self._until(ended.done)
            reason = "stopped" if self._stop.is_set() else "not_arrived"
            return MotionResult(False, reason, "the action was cancelled")
        return ended.result().result

    def _until(self, true) -> bool:
        end = time.monotonic() + PATIENCE
        while not true() and time.monotonic() < end:
            time.sleep(POLL)
        return bool(true())

    def _constraints(self, T) -> Constraints:
        pose = PoseStamped()
        pose.header.frame_id = self._base
        x, y, z, qx, qy, qz, qw = (float(value) for value in se3.to_pose7(T))
        pose.pose.position.x, pose.pose.position.y, pose.pose.position.z = x, y, z
        turn = pose.pose.orientation
        turn.x, turn.y, turn.z, turn.w = qx, qy, qz, qw
        place = PositionConstraint(link_name=self._tip, weight=1.0)
        place.header.frame_id = self._base
        ball = SolidPrimitive(type=SolidPrimitive.SPHERE, dimensions=[0.001])
        place.constraint_region.primitives = [ball]
        place.constraint_region.primitive_poses = [pose.pose]
        way = OrientationConstraint(link_name=self._tip, orientation=turn, weight=1.0)
        way.header.frame_id = self._base
        way.absolute_x_axis_tolerance = way.absolute_y_axis_tolerance = way.absolute_z_axis_tolerance = 0.01
        return Constraints(position_constraints=[place], orientation_constraints=[way])


class RosCamera:
    """Colour, depth on its pixels and camera_info as an `imop.cameras.interfaces.Camera`.

    Images have to be rectified. Depth is 16UC1 (millimetres) or 32FC1 (metres).
    """

    def __init__(self, color: str, depth: str, info: str):
        self._node, self._news = start("imop_camera"), threading.Condition()
        self._latest: dict[str, object] = {}
        for name, kind, topic in (("rgb", Image, color), ("depth", Image, depth), ("info", CameraInfo, info)):
            self._node.create_subscription(
                kind, topic, lambda message, name=name: self._heard(name, message), qos_profile_sensor_data
            )

    def capture(self) -> Frame:
        """As `Camera.capture`."""
        asked = self._node.get_clock().now()
        with self._news:
            fresh = self._news.wait_for(lambda: self._since(asked), timeout=2.0)
            seen = dict(self._latest)
        if not fresh:
            raise ConnectionError("no new image of the camera")
        depth = pixels(seen["depth"])
        metres = depth.astype(np.float32) * (1e-3 if depth.dtype == np.uint16 else 1.0)
        stamp = seen["rgb"].header.stamp
        K = np.array(seen["info"].k).reshape(3, 3)
        return Frame(pixels(seen["rgb"]), metres.astype(np.float32), K, stamp.sec + 1e-9 * stamp.nanosec)

    def _heard(self, name: str, message) -> None:
        with self._news:
            self._latest[name] = message
            self._news.notify_all()

    def _since(self, asked) -> bool:
        if len(self._latest) < 3:
            return False
        return all(Time.from_msg(self._latest[name].header.stamp) >= asked for name in ("rgb", "depth"))


def pixels(image) -> np.ndarray:
    """An image message as an array, without cv_bridge."""
    kinds = {"rgb8": (np.uint8, 3), "bgr8": (np.uint8, 3), "16UC1": (np.uint16, 1), "32FC1": (np.float32, 1)}
    kind, channels = kinds[image.encoding]
    size = np.dtype(kind).itemsize * channels
    rows = np.frombuffer(image.data, np.uint8).reshape(image.height, image.step)[:, : image.width * size]
    found = np.ascontiguousarray(rows).view(kind).reshape(image.height, image.width, channels)
    found = found[..., ::-1] if image.encoding == "bgr8" else found
    return found if channels == 3 else found[..., 0]
