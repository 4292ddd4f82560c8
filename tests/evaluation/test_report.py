import json
from dataclasses import replace

import pytest

from imop.evaluation.report import Count, Results

RESULTS = Results(
    "tabletop",
    "all",
    7,
    {"replay": {"a": Count(1, 4), "b": Count(0, 4)}, "oracle": {"a": Count(4, 4), "b": Count(2, 4)}},
    ("Same instances.",),
)


def test_the_average_is_over_tasks_not_episodes():
    uneven = Results("s", "all", 0, {"m": {"a": Count(1, 1), "b": Count(0, 9)}})
    assert uneven.average("m") == pytest.approx(0.5)


def test_results_json_has_the_layout_of_the_protocol(tmp_path):
    RESULTS.save(tmp_path)
    read = json.loads((tmp_path / "results.json").read_text())
    assert read["methods"]["oracle"] == {
        "average": 0.75,
        "tasks": {"a": {"successes": 4, "trials": 4}, "b": {"successes": 2, "trials": 4}},
    }
    assert (read["suite"], read["split"], read["seed"]) == ("tabletop", "all", 7)


def test_the_report_shows_every_count_with_its_interval(tmp_path):
    RESULTS.save(tmp_path)
    report = (tmp_path / "report.md").read_text()
    assert "| a | 25 % [5, 70] | 100 % [51, 100] |" in report
    assert "| average | 12.5 % | 75.0 % |" in report and "- Same instances." in report


def test_a_change_is_named_in_everything_that_is_written(tmp_path):
    replace(RESULTS, change="light,d415").save(tmp_path)
    assert json.loads((tmp_path / "results.json").read_text())["change"] == "light,d415"
    assert (tmp_path / "report.md").read_text().splitlines()[0].endswith("changed: light,d415")
    assert "changed" not in RESULTS.markdown()
