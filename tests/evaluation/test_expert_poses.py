import numpy as np
import pytest

from imop.evaluation.appearance import Appearance
from imop.evaluation.expert_poses import ExpertPoses
from imop.evaluation.recordings import objects_world
from imop.evaluation.trials import Trial
from imop.geometry import se3
from imop.geometry.accuracy import errors
from imop.types import Action

CUBES, POT = Trial("tabletop/stack_cubes", 1), Trial("tabletop/lid_off_pot", 1)


def expert_of(trial):
    env = trial.env()
    appearance = Appearance(objects_world(trial))
    return env, ExpertPoses(env.task, env.world, lambda: env.observation, appearance)


@pytest.mark.parametrize("quarters", [1, 2, 3])
def test_a_quarter_turned_grasp_of_a_cube_is_right(quarters):
    env, expert = expert_of(CUBES)
    waypoint = env.task.waypoints(env.world)[0]
    T_world_cube = env.world.pose(waypoint.frame)
    turn = T_world_cube @ se3.make(se3.euler(z=quarters * np.pi / 2)) @ se3.invert(T_world_cube)
    position, rotation = errors(turn @ waypoint.target(env.world), expert(0))
    assert position < 1e-6 and rotation < 1e-6


def test_an_eighth_turned_grasp_of_a_cube_is_wrong():
    env, expert = expert_of(CUBES)
    eighth = env.task.waypoints(env.world)[0].target(env.world) @ se3.make(se3.euler(z=np.pi / 4))
    assert errors(eighth, expert(0))[1] == pytest.approx(np.pi / 4, abs=0.01)


def test_the_expert_itself_is_right_and_has_no_say_after_its_last_step():
    env, expert = expert_of(POT)
    waypoints = env.task.waypoints(env.world)
    for step, waypoint in enumerate(waypoints):
        T_world_gripper = waypoint.target(env.world)
        assert max(errors(T_world_gripper, expert(step))) < 1e-6
        expert.took(step, Action(T_world_gripper, waypoint.gripper_open))
    assert expert(len(waypoints)) is None
