"""Tasks as Gymnasium environments: one step reaches one gripper pose, then moves the fingers."""

from collections.abc import Callable, Mapping
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from imop.errors import InvalidInput, PlanFailed
from imop.geometry import se3
from imop.sim.arms import PANDA, Arm
from imop.sim.cameras import CAMERAS, observe
from imop.sim.execute import execute
from imop.sim.gripper import OnFrame
from imop.sim.motion import WORKSPACE_LOWER, WORKSPACE_UPPER
from imop.sim.world import World
from imop.tasks.disturbances import Disturber
from imop.tasks.suites import find_task
from imop.tasks.task import SceneChange, Task, make_scene, wait, watching
from imop.types import Action, CameraView, FloatArray, Observation, as_array

IMAGE = 128

ObservationDict = dict[str, Any]


def make_task(name: str) -> Task:
    """The task called "suite/name", "module:Class" or "module:SUITE/name", see `find_task`.

    Raises:
        InvalidInput: if there is no such task.
    """
    task = find_task(name)()
    # Recordings and results tell a task by what it was asked for with.
    task.name = name
    return task


def make_env(
    name: str, variation: int = 0, step_limit: int | None = None, on_frame: OnFrame | None = None
) -> "ImopEnv":
    """The environment of the task called "suite/name"; see `ImopEnv`.

    Raises:
        InvalidInput: if there is no such task.
    """
    return ImopEnv(make_task(name), variation, step_limit, on_frame)


def to_array(action: Action) -> FloatArray:
    """(9,): position, quaternion xyzw, gripper open, collisions allowed."""
    return np.concatenate(
        [se3.to_pose7(action.T_world_gripper), [action.gripper_open, action.allow_collisions]]
    )


def to_action(array: FloatArray) -> Action:
    """The action of `to_array`; a quaternion of another length is scaled to 1.

    Raises:
        InvalidInput: if it is not (9,) finite numbers with a quaternion other than 0.
    """
    a = as_array("action", array, (9,))
    length = float(np.linalg.norm(a[3:7]))
    if not np.all(np.isfinite(a)) or length < 1e-6:
        problem = "not finite, or a quaternion of length 0"
        raise InvalidInput("action", problem, "x y z, quaternion x y z w, gripper open 0/1, collisions 0/1")
    pose = np.concatenate([a[:3], a[3:7] / length])
    return Action(se3.from_pose7(pose), bool(a[7] > 0.5), bool(a[8] > 0.5))


def to_observation(observation: Mapping[str, Any]) -> Observation:
    """The typed form of an environment's observation."""
    return Observation(
        views={name: CameraView(**observation[name]) for name in CAMERAS},
        T_world_gripper=observation["T_world_gripper"],
        gripper_opening=float(observation["gripper_opening"][0]),
        time_step=int(observation["time_step"]),
        joint_positions=observation["joint_positions"],
    )


def _to_dict(observation: Observation) -> ObservationDict:
    def arrays(view: CameraView) -> ObservationDict:
        return {
            "rgb": view.rgb.copy(),
            "depth": view.depth.copy(),
            "intrinsics": view.intrinsics.copy(),
            "T_world_camera": view.T_world_camera.copy(),
        }

    assert observation.joint_positions is not None
    return {
        **{name: arrays(view) for name, view in observation.views.items()},
        "T_world_gripper": observation.T_world_gripper.copy(),
        "gripper_opening": np.array([observation.gripper_opening]),
        "joint_positions": observation.joint_positions.copy(),
        "time_step": observation.time_step,
    }


def _real(*shape: int) -> spaces.Box:
    return spaces.Box(-np.inf, np.inf, shape, np.float64)


def _view_space() -> spaces.Dict:
    return spaces.Dict(
        {
            "rgb": spaces.Box(0, 255, (IMAGE, IMAGE, 3), np.uint8),
            "depth": spaces.Box(0, np.inf, (IMAGE, IMAGE), np.float32),
            "intrinsics": _real(3, 3),
            "T_world_camera": _real(4, 4),
        }
    )


class ImopEnv(gymnasium.Env[ObservationDict, FloatArray]):
    """One task. `reset` makes a new scene, `step` performs one action of the form of `to_array`.

    `reset(seed=..., options={"variation": ..., "instance_seed": ...})`: the seed decides poses and clutter;
    the instance seed decides shapes, sizes and colours and is the seed unless given. The reward is 1 when
    the aim is reached, which ends the episode. So does a motion that cannot be planned, with reward 0 and
    `info["plan_failed"]` the reason, unless there is a second try. `info["success"]` says whether the aim is
    reached, `info["disturbed"]` whether the episode was disturbed in this step.

    Args:
        task: is built anew at every reset.
        variation: number of the aim, where `reset` is not told.
        step_limit: the episode is truncated after so many steps; the task's own limit if None.
        on_frame: called with the world every 0.05 simulated seconds.
        change: of every scene, if any.
        sense: looks at the world at a time step; `observation_space` describes the robot's own cameras.
        disturb: what goes wrong once in every episode, see `disturbances.DISTURBANCES`; nothing if empty.
        second_try: whether the episode goes on after a motion that cannot be planned. Nothing moves then.
        arm: that acts.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 (Gymnasium's name and type)

    def __init__(
        self,
        task: Task,
        variation: int = 0,
        step_limit: int | None = None,
        on_frame: OnFrame | None = None,
        change: SceneChange | None = None,
        sense: Callable[[World, int], Observation] = observe,
        disturb: str = "",
        second_try: bool = False,
        arm: Arm = PANDA,
    ):
        self.task, self.variation, self.on_frame = task, variation, on_frame
        self._change, self._sense, self._arm = change, sense, arm
        self._disturb, self.second_try = disturb, second_try
        self._disturber: Disturber | None = None
        self._step_limit = step_limit or task.step_limit
        self._world: World | None = None
        self._observation: Observation | None = None
        low = np.array([*WORKSPACE_LOWER, -1, -1, -1, -1, 0, 0], dtype=np.float64)
        high = np.array([*WORKSPACE_UPPER, 1, 1, 1, 1, 1, 1], dtype=np.float64)
        self.action_space = spaces.Box(low, high, dtype=np.float64)
        self.observation_space = spaces.Dict(
            {
                **{name: _view_space() for name in CAMERAS},
                "T_world_gripper": _real(4, 4),
                "gripper_opening": spaces.Box(0, 1, (1,), np.float64),
                "joint_positions": _real(len(arm.joints)),
                "time_step": spaces.Discrete(self._step_limit + 1),
            }
        )

    @property
    def world(self) -> World:
        """The simulated scene; privileged.

        Raises:
            InvalidInput: before the first reset.
        """
        if self._world is None:
            raise InvalidInput("env", "there is no scene yet", "call reset() first")
        return self._world

    @property
    def observation(self) -> Observation:
        """The last observation, typed and with instance ids, which only training may read.

        Raises:
            InvalidInput: before the first reset.
        """
        if self._observation is None:
            raise InvalidInput("env", "there is no observation yet", "call reset() first")
        return self._observation

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[ObservationDict, dict[str, Any]]:
        """Make a new scene.

        Raises:
            InvalidInput: if an option, the variation or the disturbance is unknown.
        """
        super().reset(seed=seed)
        given = dict(options or {})
        episode = int(self.np_random.integers(2**31)) if seed is None else seed
        variation = int(given.pop("variation", self.variation))
        instance = int(given.pop("instance_seed", episode))
        if given:
            raise InvalidInput("options", ", ".join(map(str, given)), "variation, instance_seed")
        self._world = make_scene(self.task, variation, instance, episode, self._change, self._arm)
        disturb = self._disturb
        self._disturber = Disturber(disturb, self.task, self._world, episode) if disturb else None
        info = {
            "success": False,
            "variation": variation,
            "instance_seed": instance,
            "seed": episode,
            "instructions": self.task.instructions(variation),
        }
        return self._observe(0), info

    def step(self, action: FloatArray) -> tuple[ObservationDict, float, bool, bool, dict[str, Any]]:
        """Perform one action.

        Raises:
            InvalidInput: if the action is malformed, or before the first reset.
            NoRoom: if what a disturbance moves finds no place.
        """
        steps = self.observation.time_step + 1
        info: dict[str, Any] = {"success": False, "disturbed": False}
        try:
            watch = watching(self.task, self.on_frame)
            execute(self.world, to_action(action), on_frame=watch, insist=self.task.insist)
            info["disturbed"] = self._disturber is not None and self._disturber.after_action(
                self.world, watch
            )
            info["success"] = self.task.success(self.world)
        except PlanFailed as error:
            info["plan_failed"] = error.reason
        terminated = info["success"] or ("plan_failed" in info and not self.second_try)
        return self._observe(steps), float(info["success"]), terminated, steps >= self._step_limit, info

    def wait(self) -> bool:
        """After the last action, let go on what still rolls or falls; whether the aim is reached then."""
        return wait(self.task, self.world, watching(self.task, self.on_frame))

    def _observe(self, time_step: int) -> ObservationDict:
        self._observation = self._sense(self.world, min(time_step, self._step_limit))
        return _to_dict(self._observation)
