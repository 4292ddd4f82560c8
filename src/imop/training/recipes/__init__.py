"""Trainings of several commands, and what they put together."""
