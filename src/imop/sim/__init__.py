"""A headless MuJoCo world with RLBench's layout: robot, cameras, motion, expert and environment."""
