"""What a region may be: connected things, without what is in the hand."""

from dataclasses import replace

import numpy as np

from imop.geometry import se3
from imop.geometry.cloud import concatenate, middle
from imop.policy.interfaces import PolicyConfig
from imop.policy.region import Region
from imop.policy.target import Target, find_goal, obstacles, thing_of
from tests.policy.scenes import BLUE, RED, TABLE, above, at, box, camera, scene, transitions

SIZE = (0.1, 0.05, 0.06)
HOME = above(0.2, 0.1, 1.0)
CUBE = (0.04, 0.04, 0.04)


def test_every_thing_has_its_place_and_small_ones_can_be_left_out():
    cubes = [box(CUBE, RED, at(x, 0.1), seed=k) for k, x in enumerate((0.0, 0.2))]
    crumb = box((0.01, 0.01, 0.01), BLUE, at(0.4, 0.1))
    target = Target(scene([], HOME), concatenate([*cubes, crumb]))
    assert len(target.places()) == 3
    places = target.places(len(crumb) + 1)
    np.testing.assert_allclose(places[places[:, 0].argsort(), 0], (0.0, 0.2), atol=0.003)
    assert len(target.places(10**6)) == 0


def test_the_middle_does_not_depend_on_how_much_of_a_side_was_seen():
    cube = box(CUBE, RED, at(0.1, 0.1))
    half = cube.select((cube.points[:, 0] < 0.1) | (np.arange(len(cube)) % 5 == 0))
    np.testing.assert_allclose(middle(half.points), middle(cube.points), atol=0.002)


def test_what_is_in_the_hand_is_left_out_unless_it_is_the_region():
    held, other = box(CUBE, RED, at(0.2, 0.1, 0.98)), box(CUBE, BLUE, at(0.0, -0.1))
    query = scene([held, other], HOME)
    p_held = se3.apply(se3.invert(HOME), held.points)
    region = Region(other, np.ones(len(other)), p_held)
    left = query.cloud.select(obstacles(query, region))
    standing = ~query.ground.bare
    assert left.points[:, 2].max() < TABLE + 0.05 and len(left) == standing.sum() - len(held)
    is_held = Region(held, np.ones(len(held)), p_held[:0])
    np.testing.assert_array_equal(obstacles(query, is_held), standing)


def test_target_without_normals_get_them_from_their_own_points():
    cube = box((0.08, 0.08, 0.08), RED, at(0.1, 0.1), spacing=0.003)
    found = Target(scene([], HOME), replace(cube, normals=None)).cloud
    np.testing.assert_array_equal(found.points, cube.points)
    # Those of the sides may point either way for a camera straight above.
    assert np.quantile(np.abs(np.einsum("ij,ij->i", found.normals, cube.normals)), 0.2) > 0.99
    assert np.all(np.einsum("ij,ij->i", found.normals, np.array([0, 0, 2]) - found.points) >= 0)
    assert Target(scene([], HOME), cube).cloud is cube


def test_the_thing_of_a_part_is_all_that_is_connected_to_it():
    one, other = box(SIZE, RED, at(0.1, 0.1)), box(SIZE, BLUE, at(0.4, 0.1))
    standing = concatenate([one, other]).points
    assert len(thing_of(one.points[:20], standing)) == len(one)
    assert thing_of(one.points, standing[:0]) is one.points


def pushed(onto=(0.3, 0.1)):
    """A red cube is pushed from (0.1, 0.1) to beside a blue one, under a camera that then sees 9 m deep."""
    goal = box(CUBE, BLUE, at(*onto))
    places = [box(CUBE, RED, at(x, 0.1)) for x in (0.1, 0.26)]
    hands = [above(x, 0.1, TABLE + 0.02) for x in (0.07, 0.23)]
    scenes = [scene([place, goal], hand) for place, hand in zip(places, hands, strict=True)]
    view = camera(np.full((64, 64), 9.0, np.float32))
    scenes[1] = replace(scenes[1], observation=replace(scenes[1].observation, views={"top": view}))
    step = transitions(scenes, [(scenes[1].observation.T_world_gripper, False)])[0]
    return step, Region(places[0], np.ones(len(places[0])), np.zeros((0, 3)))


def test_the_goal_is_what_stands_where_the_hand_goes_and_stays_there():
    step, region = pushed()
    goal = find_goal(step, region, PolicyConfig())
    assert np.allclose(goal.cloud.colors, np.array(BLUE, np.float32))
    assert goal.weight.max() == 1 and len(goal.thing) >= len(goal.cloud)
    away = np.linalg.norm(goal.cloud.points - step.action.T_world_gripper[:3, 3], axis=1)
    assert (np.diff(goal.weight[away.argsort()]) <= 0).all()


def test_what_is_only_hidden_afterwards_still_stands_there():
    step, region = pushed()
    after = replace(step.after, fused=step.after.fused.select(np.arange(400)))
    hidden, seen_through = (
        replace(step, after=replace(after, observation=replace(after.observation, views={"top": camera(d)})))
        for d in (np.full((64, 64), depth, np.float32) for depth in (0.5, 9.0))
    )
    assert find_goal(hidden, region, PolicyConfig()) is not None
    assert find_goal(seen_through, region, PolicyConfig()) is None


def test_there_is_no_goal_far_away_and_none_beside_the_region():
    step, _ = pushed()
    blue = step.before.cloud.select(step.before.cloud.colors[:, 2] > 0.6)
    assert find_goal(step, Region(blue, np.ones(len(blue)), np.zeros((0, 3))), PolicyConfig()) is None
    step, region = pushed(onto=(0.5, 0.1))
    assert find_goal(step, region, PolicyConfig()) is None
