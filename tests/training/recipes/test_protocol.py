"""The paper's protocol, as commands: each makes what later ones read, and all draw from base tasks alone."""

import shlex
from pathlib import Path

from imop.training.recipes.protocol import ProtocolConfig, stages

CONFIG = ProtocolConfig(Path("a folder"))


def test_every_stage_reads_what_one_before_it_made():
    made = set()
    for stage in stages(CONFIG):
        words = shlex.split(stage.command)
        out = words[words.index("--out") + 1]
        read = {w for w in words if w.startswith("a folder") and w != out}
        assert read <= made, stage.name
        made.add(out)


def test_no_novel_task_is_recorded():
    words = shlex.split(stages(CONFIG)[0].command)
    assert words[words.index("--split") + 1] == "base" and words[words.index("--suite") + 1] == "rlbench"


def test_the_weights_lie_directly_in_the_folder():
    assert stages(CONFIG)[-1].makes == "card.json"
