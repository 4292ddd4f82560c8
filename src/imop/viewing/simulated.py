"""An episode of a task on the simulator, as a world to look at."""

import numpy as np

from imop.evaluation.trials import Trial
from imop.sim.execute import plan_for
from imop.tasks.env import to_array
from imop.types import Action, FloatArray, Observation
from imop.viewing.worlds import Outcome


class SimulatedWorld:
    """A trial's scene.

    Args:
        trial: which scene.
    """

    def __init__(self, trial: Trial) -> None:
        self._env = trial.env()

    def observe(self) -> Observation:
        """What the simulated cameras see."""
        return self._env.observation.stripped()

    def way(self, action: Action) -> FloatArray:
        """As the motion planner finds it."""
        T_goal, free = action.T_world_gripper, action.allow_collisions
        planned = plan_for(self._env.world, T_goal, free, insist=self._env.task.insist)
        some = np.linspace(0, len(planned.positions) - 1, min(60, len(planned.positions))).astype(int)
        tip_pose = self._env.world.arm.kinematics.tip_pose
        return np.stack([tip_pose(q)[:3, 3] for q in planned.positions[some]])

    def known(self) -> None:
        """Nobody has gone from here."""

    def perform(self, action: Action) -> Outcome:
        """One step of the environment."""
        _, _, terminated, truncated, info = self._env.step(to_array(action))
        if info["success"] or (truncated and self._env.wait()):
            return Outcome(True, "done: the task has succeeded")
        if "plan_failed" in info:
            failed = info["plan_failed"]
            return Outcome(terminated, f"no motion: {failed}", failed)
        return Outcome(truncated, "not done after the last action" if truncated else "")

    def stop(self) -> None:
        """A simulated motion is over before anybody could stop it."""
