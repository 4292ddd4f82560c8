"""Which scene a simulated robot stands in."""

from dataclasses import dataclass


@dataclass(frozen=True)
class SceneOf:
    """The task whose scene a simulated robot stands in; see `Trial`."""

    task: str
    seed: int = 1
    variation: int = 0
    instance: int = 0
