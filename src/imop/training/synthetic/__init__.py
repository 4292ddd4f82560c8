"""Procedural scenes, what is done in them, and the pairs and routes that come of it."""
