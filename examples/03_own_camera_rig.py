"""Describe a cell with its own cameras, check the description, and see through it. Simulated here."""

import sys
from pathlib import Path

from imop import Setup, make_task, save_setup
from imop.robots.panda import PANDA_HOME_Q, T_WORLD_BASE
from imop.setup.arm import arm_of
from imop.setup.check import check_setup
from imop.setup.setup import CameraSetup, RobotSetup, WorkspaceSetup
from imop.sim.cameras import look_at
from imop.sim.driver import SimulatedCamera, SimulatedRobot
from imop.tasks.task import make_scene

TABLE, SIZE = (0.25, 0.0, 0.75), (320, 240)
eyes = {"left": (1.0, 0.6, 1.5), "right": (1.0, -0.6, 1.5)}
placed = {name: look_at(eye, TABLE, 50.0) for name, eye in eyes.items()}
setup = Setup(
    RobotSetup("panda", PANDA_HOME_Q, T_WORLD_BASE),
    WorkspaceSetup((-0.1, -0.5, 0.7), (0.7, 0.5, 1.6), table_height=0.75),
    {
        name: CameraSetup(camera.intrinsics(*SIZE), SIZE, T_world_camera=camera.T_mount_camera)
        for name, camera in placed.items()
    },
)
save_setup(setup, Path(sys.argv[1]) / "cell.toml")  # `imop setup check cell.toml` reads it, too

# Drivers of an arm and of cameras; of real ones, it is the same.
world = make_scene(make_task("tabletop/stack_cubes"), variation=0, instance_seed=1, seed=1)
robot = SimulatedRobot(world)
cameras = {name: SimulatedCamera(world, camera, SIZE) for name, camera in placed.items()}

observation = setup.observation(robot.state(), {name: c.capture() for name, c in cameras.items()})
for finding in check_setup(setup, observation):
    print(finding)
cloud = arm_of(setup).perception(setup)(observation)
print(f"{len(cloud)} points of what stands on the table, without the arm")
