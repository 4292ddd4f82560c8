"""Robots without a simulator: where their parts are at the measured joints, and which points are theirs."""
