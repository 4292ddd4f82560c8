"""Losses, metrics, and the loop that trains the networks."""
