"""What a benchmark tries, apart from it so that the command line can show it without waiting for torch."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

Disturb = Literal["", "moved", "knocked", "missed", "shut"]
Instances = Literal["same", "other"]
"""Of the objects in a test scene, against the demonstrated ones."""


@dataclass(frozen=True)
class EvaluationConfig:
    """Which methods are tried in which scenes.

    Attributes:
        suite: tabletop, rlbench, or one's own, such as my_suite:SUITE.
        split: base, novel, cross_object, real, chain, chain_novel (tabletop), long (rlbench) or all.
        tasks: names within the split; all if none is given.
        methods: any of replay, textbook (FPFH, RANSAC and ICP of Open3D, extra baselines), registration,
            learned (the routing network may go back to a step), advancing (learned, but steps follow each
            other as shown), paper (the paper's networks and one fit, no search), act3d and rvt (regressors in
            the manner of these), rvt_ft and rvt_hdt (rvt, fine-tuned on the demonstration of a novel task),
            oracle (true object poses), expert, or one's own (my_methods:MyPolicy), joined by commas.
        episodes: scenes per task, spread over its variations.
        seed: first seed of the scenes.
        instance: seed of the demonstrated objects' shapes, sizes and colours.
        instances: whether the scenes show the same objects, or in each scene others of their kind.
        change: what the scenes differ in from the demonstrated ones, joined by commas: object_color,
            object_size, light, table_color, distractors, camera_pose, or all of these as all; errors of the
            sensors d415, calibration, knocked; two_cameras, fewer_cameras. docs/tasks.md says what they are.
        disturb: what goes wrong once in every episode: what is about to be acted on is moved by 10 cm, what
            was taken is knocked out of the hand, missed by it, or what was opened is pushed shut.
        second_try: go on after a motion that cannot be planned, up to the task's limit of actions; always
            so if disturbed.
        demonstrations: how many are shown, each but the first of another instance of the things.
        jobs: parallel processes.
        weights: folder that `imop train` wrote, for the learned policy; by default the bundled weights.
        baselines: folder of the weights of act3d, rvt, rvt_ft and rvt_hdt (docs/baselines.md); by default
            runs/baselines.
        robot: the arm, with the Panda's hand; all but the Panda need the extra arms, in the suite tabletop.
        out: folder for the results, and for the log of all episodes.
    """

    suite: str = "tabletop"
    split: str = "all"
    tasks: tuple[str, ...] = ()
    methods: Annotated[str, tyro.conf.arg(metavar="NAME,NAME")] = "replay,registration,learned,oracle,expert"
    episodes: int = 25
    seed: int = 0
    instance: int = 0
    instances: Instances = "same"
    change: Annotated[str, tyro.conf.arg(metavar="FACTOR,FACTOR")] = ""
    disturb: Disturb = ""
    second_try: bool = False
    demonstrations: int = 1
    jobs: int = 2
    weights: Path | None = None
    baselines: Path | None = None
    robot: Literal["panda", "iiwa", "iiwa14", "ur5e"] = "panda"
    out: Path = Path("runs/eval")
