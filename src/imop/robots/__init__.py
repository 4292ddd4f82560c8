"""Robots without a simulator: where their parts are at the measured joints, and which points are theirs."""

ARMS = ("panda", "iiwa14", "ur5e")
"""Names of the arms that imop knows without a model file of one's own; the first needs no extra."""


def arm_name(name: str) -> str:
    """The name that an arm has in `ARMS`, where it has others too: the iiwa is the iiwa14."""
    return {"iiwa": "iiwa14"}.get(name, name)
