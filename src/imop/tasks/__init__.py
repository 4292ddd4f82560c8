"""Tasks: what stands on the table, when it is done, and how an expert does it."""

from imop.extras import extra

with extra("sim"):
    import gymnasium  # noqa: F401
    import mujoco  # noqa: F401
