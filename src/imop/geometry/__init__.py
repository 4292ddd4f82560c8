"""Rigid motions, point clouds and the robot's own shape. Knows types; knows nothing of learning."""
