"""Cameras: what imop asks of one, and drivers."""
