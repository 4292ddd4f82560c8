import numpy as np
import pytest

from imop.evaluation.appearance import Appearance
from imop.evaluation.expert_poses import ExpertPoses
from imop.evaluation.recordings import objects_world
from imop.evaluation.trials import Trial, demonstration_for
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


def test_after_another_laptop_the_expert_and_the_demonstrated_pose_are_right_and_nothing_between():
    trial = Trial("tabletop/close_laptop", 1, 0, 1, shown=0)
    env, shown = trial.env(), demonstration_for(trial)
    known = env.task, env.world, lambda: env.observation, Appearance(objects_world(trial))
    plain, expert = ExpertPoses(*known)(0), ExpertPoses(*known, shown)(0)
    first = shown.keyframes[0]
    T_object_gripper = se3.invert(first.T_world_object) @ first.action.T_world_gripper
    carried = env.world.pose(first.object_name) @ T_object_gripper
    own = env.task.waypoints(env.world)[0].target(env.world)
    # Their screens differ in height, and the expert pushes near the upper edge.
    assert errors(carried, plain)[0] > 0.02
    assert max(errors(carried, expert)) < 1e-6 and max(errors(own, expert)) < 1e-6
    middle = own.copy()
    middle[:3, 3] = (own[:3, 3] + carried[:3, 3]) / 2
    assert errors(middle, expert)[0] > 0.01
    assert (expert[0] == plain[0]).all()


def test_what_the_demonstration_fixed_to_something_else_is_not_right_here():
    trial = Trial("tabletop/open_drawer", 1, 0)
    env = trial.env()
    known = env.task, env.world, lambda: env.observation, Appearance(objects_world(trial))
    elsewhere = demonstration_for(Trial("tabletop/open_drawer", 1, 1))
    assert elsewhere.keyframes[0].object_name != env.task.waypoints(env.world)[0].frame
    assert (ExpertPoses(*known, elsewhere)(0) == ExpertPoses(*known)(0)).all()
