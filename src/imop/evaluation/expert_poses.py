"""Where the expert would go from the present state of an episode, in every way that looks the same."""

from collections.abc import Callable

from imop.evaluation.appearance import Appearance
from imop.evaluation.equal_poses import equal_poses
from imop.sim.world import World
from imop.tasks.task import Task
from imop.tasks.waypoint import Waypoint
from imop.types import Action, Demonstration, FloatArray, Keyframe, Observation


class ExpertPoses:
    """What a policy's poses are compared with: a cube may be grasped a quarter turned.

    Args:
        task: built in `world`.
        world: the scene as the episode goes on.
        observe: what is seen of it now.
        appearance: of the objects in `world`.
        shown: what was demonstrated, if it was with others of their kind: then its poses are right, too.
    """

    def __init__(
        self,
        task: Task,
        world: World,
        observe: Callable[[], Observation],
        appearance: Appearance,
        shown: Demonstration | None = None,
    ):
        self._task, self._world, self._observe, self._appearance = task, world, observe, appearance
        self._shown = shown
        self._taken: dict[int, Keyframe] = {}

    def __call__(self, step: int) -> FloatArray | None:
        """(N, 4, 4) T_world_gripper of all right poses of a step, or None if the expert has no such step."""
        observation, waypoints = self._observe(), self._task.waypoints(self._world)
        if step >= len(waypoints):
            return None
        steps = [self._keyframe(w, w.target(self._world), observation) for w in waypoints]
        for number, keyframe in self._taken.items():
            if number < step:
                steps[number] = keyframe
        return equal_poses(Demonstration(tuple(steps), observation), step, self._appearance, self._shown)

    def took(self, step: int, action: Action) -> None:
        """The policy is about to act for a step; what it grasps lies in the hand as it did there."""
        waypoints = self._task.waypoints(self._world)
        if step < len(waypoints):
            waypoint = waypoints[step]
            self._taken[step] = self._keyframe(waypoint, action.T_world_gripper, self._observe())

    def _keyframe(
        self, waypoint: Waypoint, T_world_gripper: FloatArray, observation: Observation
    ) -> Keyframe:
        T_world_object = self._world.pose(waypoint.frame)
        action = Action(T_world_gripper, waypoint.gripper_open)
        return Keyframe(observation, action, waypoint.frame, T_world_object)
