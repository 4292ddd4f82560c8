import pytest

from imop.evaluation.open_loop_rows import Row, by_task, summary
from imop.geometry.accuracy import COARSE, FINE


def row(step=0, task="a", **fields):
    return Row("method", task, 0, "support", "query", step, "cube", **fields)


def test_both_limits_have_to_be_kept():
    assert row(position=0.009, rotation=4.9).within(FINE)
    assert not row(position=0.011, rotation=4.9).within(FINE)
    assert not row(position=0.009, rotation=5.1).within(FINE)
    assert row(position=0.011, rotation=5.1).within(COARSE)


def test_what_was_not_predicted_is_a_miss_but_has_no_error():
    missing = row(problem="confidence: 0.1 is below the required 0.5")
    found = summary([row(position=0.001, rotation=1.0, plain_position=0.2, plain_rotation=1.0), missing])
    assert found["within_2cm_10deg"] == found["within_1cm_5deg"] == found["missing"] == 0.5
    assert found["within_2cm_10deg_of_the_recorded_pose"] == 0
    assert found["position_median_m"] == pytest.approx(0.001)
    assert summary([missing])["position_median_m"] is None


def test_steps_that_the_state_gives_away_do_not_count_where_it_matters():
    good = {"position": 0.0, "rotation": 0.0}
    found = summary([row(**good, repeatable=True), row(**good), row()])
    assert found["within_2cm_10deg_of_not_repeatable"] == 0.5 and found["not_repeatable"] == 2
    assert summary([row(repeatable=True)])["within_2cm_10deg_of_not_repeatable"] is None


def test_routing_counts_only_where_there_is_a_router():
    assert summary([row()])["routing_accuracy"] is None
    assert summary([row(2, routed=2), row(3, routed=2), row(4)])["routing_accuracy"] == 0.5


def test_rows_are_counted_by_task_and_step():
    good = {"position": 0.0, "rotation": 0.0}
    rows = [row(0, "a", **good), row(1, "a"), row(0, "b", **good), row(0, "b", **good)]
    found = by_task(rows)
    assert found["all"]["n"] == 4 and found["all"]["within_1cm_5deg"] == 0.75
    assert found["tasks"]["a"]["steps"]["1"]["within_1cm_5deg"] == 0
    assert found["tasks"]["b"]["all"]["n"] == 2 and set(found["tasks"]["b"]["steps"]) == {"0"}
