"""The expert: follows a task's waypoints and records what it sees and does."""

from collections.abc import Mapping
from dataclasses import replace

from imop.errors import ImopError, PlanFailed
from imop.sim.arms import PANDA, Arm
from imop.sim.cameras import CAMERAS, Camera, observe
from imop.sim.execute import move, plan_for
from imop.sim.gripper import OnFrame, set_gripper
from imop.sim.world import World
from imop.tasks.task import Task, make_scene, wait, watching
from imop.tasks.waypoint import Waypoint
from imop.types import Action, Demonstration, Keyframe, Observation


class ExpertFailed(ImopError):
    """The expert did not reach the aim; another seed gives another scene."""

    def __init__(self, task: str, step: int, reason: str):
        self.task, self.step, self.reason = task, step, reason
        super().__init__(f"{task}: the expert failed at step {step}: {reason}; try another seed")


def record_demonstration(
    task: Task,
    seed: int,
    variation: int = 0,
    instance_seed: int | None = None,
    on_frame: OnFrame | None = None,
    arm: Arm = PANDA,
    cameras: Mapping[str, Camera] = CAMERAS,
) -> Demonstration:
    """Let the expert do `task` once in a new scene.

    Args:
        task: built anew by this call.
        seed: of the scene's poses and clutter.
        variation: number of the aim.
        instance_seed: of the objects; `seed` if None.
        on_frame: called with the world every 0.05 simulated seconds.
        arm: that does it.
        cameras: that look on.

    Returns:
        One keyframe per waypoint, with the privileged object names and poses.

    Raises:
        ExpertFailed: if a motion was not found or the aim was not reached.
        InvalidInput: if the task has no such variation.
    """
    instance_seed = seed if instance_seed is None else instance_seed
    world = make_scene(task, variation, instance_seed, seed, arm=arm)
    demonstration = perform(task, world, on_frame, cameras)
    seeds = {"instance": instance_seed, "episode": seed}
    words = task.instructions(variation)
    return replace(demonstration, variation=variation, instructions=words, seeds=seeds)


def perform(
    task: Task,
    world: World,
    on_frame: OnFrame | None = None,
    cameras: Mapping[str, Camera] = CAMERAS,
) -> Demonstration:
    """Let the expert do `task`, which `world` was made for, from the present state.

    Raises:
        ExpertFailed: if a motion was not found or the aim was not reached.
    """
    count = len(task.waypoints(world))
    watch = watching(task, on_frame)
    keyframes = []
    for step in range(count):
        seen, waypoint = observe(world, step, cameras=cameras), task.waypoints(world)[step]
        try:
            keyframes.append(_follow(world, waypoint, seen, watch, task.insist))
        except PlanFailed as error:
            raise ExpertFailed(task.name, step, error.reason) from error
    if not wait(task, world, watch):
        raise ExpertFailed(task.name, count, "all waypoints were reached, but not the aim")
    return Demonstration(tuple(keyframes), observe(world, count, cameras=cameras), task=task.name)


def _follow(
    world: World, waypoint: Waypoint, seen: Observation, on_frame: OnFrame | None, insist: bool
) -> Keyframe:
    T_world_object = world.pose(waypoint.frame)
    # Like a policy's actions: straight where possible. Scenes are chosen so that linear waypoints are.
    plan = plan_for(world, waypoint.target(world), waypoint.allow_collisions, insist=insist)
    move(world, plan, on_frame)
    action = Action(world.T_world_gripper, waypoint.gripper_open, waypoint.allow_collisions)
    set_gripper(world, waypoint.gripper_open, on_frame, waypoint.opening)
    return Keyframe(seen, action, waypoint.frame, T_world_object)
