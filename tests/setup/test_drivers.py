"""Drivers by the names in a set-up, on a simulated scene."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.setup.drivers import SimulatedScene, connected
from imop.setup.file import from_dict, load_setup, to_dict
from imop.sim.cameras import observe
from imop.sim.world import World, scene_spec

CELL = load_setup(Path(__file__).parents[2] / "examples" / "simulated_cell.toml")


@pytest.fixture(scope="module")
def scene():
    return SimulatedScene(World(scene_spec()))


def seen(setup, scene):
    with connected(setup, scene) as (robot, cameras):
        return setup.observation(robot.state(), {n: c.capture() for n, c in cameras.items()})


def test_the_example_sees_what_the_simulation_shows(scene):
    expected, observation = observe(scene.world), seen(CELL, scene)
    assert np.allclose(observation.T_world_gripper, expected.T_world_gripper)
    for name, view in expected.views.items():
        assert np.array_equal(observation.views[name].depth, view.depth)
        assert np.allclose(observation.views[name].T_world_camera, view.T_world_camera)


def test_where_the_base_stands_in_the_world_changes_no_picture(scene):
    T = se3.make(se3.euler(z=0.7), (3.0, -2.0, -0.75))
    space, robot = CELL.workspace, CELL.robot
    cameras = {
        name: camera if camera.on_gripper else replace(camera, T_world_camera=T @ camera.T_world_camera)
        for name, camera in CELL.cameras.items()
    }
    lower, upper = space.lower - (0, 0, 0.75), space.upper - (0, 0, 0.75)
    moved = replace(
        CELL,
        robot=replace(robot, T_world_base=T @ robot.T_world_base),
        cameras=cameras,
        workspace=replace(space, lower=lower, upper=upper, table_height=0.0),
    )
    here, there = seen(CELL, scene), seen(moved, scene)
    assert np.allclose(there.T_world_gripper, T @ here.T_world_gripper)
    for name, view in here.views.items():
        close = np.isclose(there.views[name].depth, view.depth, atol=1e-3)
        assert close.mean() > 0.999


@pytest.mark.parametrize(
    ("where", "field"),
    [("robot", "robot.driver"), ("cameras.front", "cameras.front.driver")],
)
def test_a_driver_that_is_not_named_or_not_known_is_refused(where, field, scene):
    fields = to_dict(CELL)
    table = fields["robot"] if where == "robot" else fields["cameras"]["front"]
    del table["driver"]
    with pytest.raises(InvalidInput, match=field), connected(from_dict(fields), scene):
        pass
    table["driver"] = "abb"
    with pytest.raises(InvalidInput, match=field):
        from_dict(fields)


def test_simulated_drivers_need_a_scene_with_their_arm_and_real_ones_an_address(scene):
    with pytest.raises(InvalidInput, match="task"), connected(CELL):
        pass
    other = replace(CELL, robot=replace(CELL.robot, model="ur5e", home=np.zeros(6)))
    with pytest.raises(InvalidInput, match="panda"), connected(other, scene):
        pass
    for driver in ("franka", "universal_robots"):
        real = replace(CELL, robot=replace(CELL.robot, driver=driver))
        with pytest.raises(InvalidInput, match="address"), connected(real):
            pass


def test_an_exception_stops_the_arm(scene, monkeypatch):
    stopped = []
    monkeypatch.setattr("imop.sim.driver.SimulatedRobot.stop", lambda robot: stopped.append(robot))
    with pytest.raises(KeyboardInterrupt), connected(CELL, scene):
        raise KeyboardInterrupt
    assert len(stopped) == 1
