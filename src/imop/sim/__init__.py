"""A headless MuJoCo world with RLBench's layout: robot, cameras, motion, expert and environment."""

from imop.extras import extra

with extra("sim"):
    import frankik  # noqa: F401
    import mujoco  # noqa: F401
    import ompl  # noqa: F401
    import toppra  # noqa: F401
