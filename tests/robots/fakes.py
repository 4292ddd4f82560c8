"""The makers' packages as far as the drivers call them, with the makers' own names of parameters.

`test_signatures.py` compares them with the real packages where those are installed.
"""

import types

import numpy as np

from imop.geometry import se3
from imop.robots.universal_robots_poses import from_vector, to_vector

STEPS = 6
"""Looks that a motion takes."""


class _Line:
    """An arm that gets along a line by one step whenever it is waited for."""

    def __init__(self):
        self.T, self.way, self.error, self.fails = np.eye(4), [], None, False

    def begin(self, T):
        ends = self.T[:3, 3], T[:3, 3]
        self.way = [se3.make(T[:3, :3], p) for p in np.linspace(*ends, STEPS + 1)[1:]]

    def step(self):
        if self.way:
            self.T = self.way.pop(0)


def franky_module():
    module = types.ModuleType("franky")

    class FrankaError(Exception):
        pass

    class ControlException(FrankaError):
        pass

    class NetworkException(FrankaError):
        pass

    class Affine:
        def __init__(self, transformation_matrix):
            self.matrix = np.asarray(transformation_matrix)

    class RelativeDynamicsFactor:
        def __init__(self, velocity, acceleration, jerk):
            self.velocity, self.acceleration, self.jerk = velocity, acceleration, jerk

    class CartesianMotion:
        def __init__(self, target):
            self.target = target

    class CartesianStopMotion:
        def __init__(self):
            pass

    class Limit:
        def __init__(self, most):
            self.max, self.value = most, most

        def set(self, value):
            assert np.all(np.asarray(value) <= self.max)
            self.value = value

    class Robot:
        def __init__(self, fci_hostname, realtime_config):
            if fci_hostname == "nowhere":
                raise NetworkException("no route to nowhere")
            self.line, self.has_errors = _Line(), False
            self.translation_velocity_limit, self.rotation_velocity_limit = Limit(1.7), Limit(2.5)
            self.elbow_velocity_limit = Limit(2.175)
            self.joint_velocity_limit = Limit(np.full(7, 2.175))
            self.T_flange_ee = se3.make(se3.euler(z=0.3), (0.0, 0.0, 0.05))

        @property
        def state(self):
            if self.line.error is not None:
                raise self.line.error
            return types.SimpleNamespace(
                O_T_EE=Affine(self.line.T),
                F_T_EE=Affine(self.T_flange_ee),
                q=np.zeros(7),
                robot_mode="Reflex",
            )

        def move(self, motion, asynchronous):
            assert asynchronous
            if isinstance(motion, CartesianStopMotion):
                self.line.way = self.line.way[:1]
            else:
                self.line.begin(motion.target.matrix)

        def join_motion(self, timeout):
            if self.line.fails and len(self.line.way) < STEPS - 1:
                self.line.way, self.has_errors = [], True
                raise ControlException("cartesian_reflex")
            self.line.step()
            return not self.line.way

        def recover_from_errors(self):
            self.has_errors = self.line.fails = False
            return True

    class Future:
        def __init__(self, hand):
            self.hand = hand

        def wait(self, timeout):
            self.hand.width += np.clip(self.hand.target - self.hand.width, -0.02, 0.02)
            return self.hand.width == self.hand.target

        def get(self):
            return not self.hand.blocked

    class Gripper:
        def __init__(self, fci_hostname):
            self.width = self.target = self.max_width = 0.08
            self.blocked, self.grasps = 0.0, 0

        @property
        def state(self):
            return self

        def move_async(self, width, speed):
            self.target = max(width, self.blocked)
            return Future(self)

        def grasp_async(self, width, speed, force, epsilon_inner, epsilon_outer):
            assert epsilon_inner >= 0.08 and epsilon_outer >= 0.08
            self.grasps += 1
            return self.move_async(width, speed)

        def stop(self):
            self.target = self.width

    module.Exception = FrankaError
    module.RealtimeConfig = types.SimpleNamespace(Enforce="enforce", Ignore="ignore")
    for one in (
        ControlException,
        NetworkException,
        Affine,
        RelativeDynamicsFactor,
        CartesianMotion,
        CartesianStopMotion,
        Robot,
        Gripper,
    ):
        setattr(module, one.__name__, one)
    return module


class Controller:
    """What the three interfaces of a Universal Robots controller share."""

    def __init__(self):
        self.line, self.protective, self.emergency, self.program = _Line(), False, False, True
        self.connected, self.safe, self.speed, self.unlocked = True, True, 0.0, 0


def ur_modules(controller):
    """The modules rtde_control, rtde_receive and dashboard_client, of one controller."""

    class RTDEControlInterface:
        def __init__(self, hostname):
            if hostname == "nowhere":
                raise RuntimeError("timeout")
            self.tcp = None

        def setTcp(self, arg0):
            self.tcp = arg0
            return True

        def isPoseWithinSafetyLimits(self, arg0):
            return controller.safe

        def moveL(self, pose, speed, acceleration, asynchronous):
            assert asynchronous and self.tcp is not None
            controller.speed = speed
            controller.line.begin(from_vector(pose))
            return controller.program

        def stopL(self, a):
            controller.line.way = []

        def isConnected(self):
            return controller.connected

        def reconnect(self):
            return controller.connected

        def isProgramRunning(self):
            return controller.program

        def reuploadScript(self):
            controller.program = True
            return True

        def stopScript(self):
            controller.program = False

        def disconnect(self):
            pass

    class RTDEReceiveInterface:
        def __init__(self, hostname):
            pass

        def isConnected(self):
            return controller.connected

        def getActualTCPPose(self):
            return to_vector(controller.line.T)

        def getActualTCPSpeed(self):
            moving = bool(controller.line.way)
            controller.line.step()
            if controller.line.fails and moving and len(controller.line.way) < 3:
                controller.line.way, controller.protective, controller.program = [], True, False
            return [0.1 * moving] + [0.0] * 5

        def getActualQ(self):
            return [0.0] * 6

        def isProtectiveStopped(self):
            return controller.protective

        def isEmergencyStopped(self):
            return controller.emergency

        def disconnect(self):
            pass

    class DashboardClient:
        def __init__(self, hostname):
            pass

        def connect(self):
            pass

        def closeSafetyPopup(self):
            pass

        def unlockProtectiveStop(self):
            controller.protective, controller.unlocked = False, controller.unlocked + 1
            controller.line.fails = False

        def disconnect(self):
            pass

    modules = {}
    for name, one in (
        ("rtde_control", RTDEControlInterface),
        ("rtde_receive", RTDEReceiveInterface),
        ("dashboard_client", DashboardClient),
    ):
        modules[name] = types.ModuleType(name)
        setattr(modules[name], one.__name__, one)
    return modules
