"""Success rates of several methods in the same scenes, with intervals; `imop eval` does the same."""

import sys
from pathlib import Path

from imop.evaluation.benchmark import evaluate_suite
from imop.evaluation.config import EvaluationConfig
from imop.evaluation.statistics import wilson
from imop.terminal import console

config = EvaluationConfig(
    suite="tabletop",
    split="base",
    tasks=("open_drawer",),
    methods="learned,replay",
    episodes=3,
    seed=10,
    instances="other",  # in each scene another drawer than the one that was shown
    jobs=1,
    out=Path(sys.argv[1]),
)
results = evaluate_suite(config, console)  # every episode is logged: run again, it goes on
console.print(results.table())
for method, tasks in results.counts.items():
    count = tasks["open_drawer"]
    low, high = wilson(count.successes, count.trials)
    print(f"{method}: {count.successes} of {count.trials}, 95 % interval {low:.2f} to {high:.2f}")
