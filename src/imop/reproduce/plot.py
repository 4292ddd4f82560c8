"""Success by task as grouped bars, one picture a table."""

from pathlib import Path
from typing import Any

import numpy as np

from imop.evaluation.report import Count
from imop.evaluation.statistics import wilson
from imop.extras import extra
from imop.files import replaced
from imop.reproduce.measured import Measured, MeasuredSection
from imop.reproduce.write import published_label

_INCHES_OF_A_BAR = 0.11
_SMALLEST, _LARGEST = 6.0, 40.0
_HATCH = "////"


def save_plot(measured: Measured, path: Path) -> bool:
    """Draw every section that has rates by task; whether there was one.

    Args:
        measured: the table. Measured rows have 95 % Wilson intervals, published ones are hatched.
        path: of the PNG file.

    Raises:
        MissingExtra: without matplotlib.
    """
    with extra("viz"):
        from matplotlib.figure import Figure

    bars = [(section, found) for section in measured.sections if (found := _bars(section))]
    if not bars:
        return False
    most = max(len(section.tasks) * (len(found) + 2) for section, found in bars)
    width = float(np.clip(_INCHES_OF_A_BAR * most, _SMALLEST, _LARGEST))
    figure = Figure(figsize=(width, 3.6 * len(bars)), layout="constrained")
    axes = figure.subplots(len(bars), squeeze=False)[:, 0]
    for axis, (section, found) in zip(axes, bars, strict=True):
        _draw(axis, section, found)
    with replaced(path) as temporary:
        figure.savefig(temporary, format="png", dpi=110)
    return True


Bars = tuple[str, bool, dict[str, tuple[float, float, float]]]
"""Label, whether it is published, and task -> rate, lower and upper bound in percent."""


def _bars(section: MeasuredSection) -> list[Bars]:
    """Those of the rows that have rates of the section's tasks."""
    bars: list[Bars] = [
        (row.label, False, {task: _percent(count) for task, count in (row.counts or {}).items()})
        for row in section.rows
    ]
    for row in section.published:
        rates = {task: rate for task, rate in row.tasks.items() if task in section.tasks}
        bars.append((published_label(row), True, {task: (rate, rate, rate) for task, rate in rates.items()}))
    return [one for one in bars if one[2]]


def _percent(count: Count) -> tuple[float, float, float]:
    low, high = wilson(count.successes, count.trials)
    return 100 * count.rate, 100 * low, 100 * high


def _draw(axis: Any, section: MeasuredSection, bars: list[Bars]) -> None:
    width = 1 / (len(bars) + 2)
    for k, (label, is_published, rates) in enumerate(bars):
        at = [i for i, task in enumerate(section.tasks) if task in rates]
        rate, low, high = np.reshape([rates[section.tasks[i]] for i in at], (-1, 3)).T
        x = np.array(at) + (k - (len(bars) - 1) / 2) * width
        shown = {"hatch": _HATCH, "alpha": 0.4} if is_published else {"yerr": (rate - low, high - rate)}
        axis.bar(x, rate, width, label=label, color=f"C{k % 10}", error_kw={"elinewidth": 0.7}, **shown)
    axis.set(title=section.title, ylabel="success, %", ylim=(0, 103))
    axis.set_xticks(range(len(section.tasks)), section.tasks, rotation=30, ha="right", fontsize=8)
    axis.legend(fontsize=7, loc="upper left", bbox_to_anchor=(1, 1))
