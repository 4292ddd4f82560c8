"""The benchmark on procedural scenes: what is right, what counts, and what it does not depend on."""

from dataclasses import replace

import numpy as np
import pytest
from benchmarks.held_out import Options, Row, drawn, make_matcher, measure, off, predict, summary
from joblib import parallel_config

from benchmarks import held_out
from imop.errors import InvalidInput
from imop.networks.model import BUNDLED
from imop.policy.interfaces import Candidate


@pytest.fixture(scope="module")
def group():
    return next(drawn(Options(families="training", kinds="sink"), 0))[0]


@pytest.fixture(scope="module")
def example(group):
    return group[0]


def test_the_right_motion_has_no_error_and_another_has_its_own(example):
    T = example.pair.T_query_support[0]
    assert off([Candidate(T, 1.0)], example) == pytest.approx((0.0, 0.0), abs=1e-5)
    lifted = T.copy()
    lifted[2, 3] += 0.03
    assert off([Candidate(lifted, 1.0)], example) == pytest.approx((0.03, 0.0), abs=1e-5)
    assert off([], example) == (None, None) and len(example.right_poses())


def test_what_is_not_there_counts_apart():
    right, none = Row("m", "0-0", 0, 0.0, 0.0, 1.0, 0.9, 0.1), Row("m", "0-1", 0, None, None, 0.0, 0.0, 0.1)
    absent = replace(none, absent=True, confidence=0.4)
    found = summary([right, none, absent])
    assert (found["n"], found["within_2cm_10deg"], found["absent"]) == (2, 0.5, 1)
    assert found["absent_confidence_median"] == pytest.approx(0.4)


def test_rows_do_not_depend_on_the_number_of_processes(monkeypatch):
    def rows(options, number):
        return [Row("learned", f"{number}-{i}", i, 0.0, 0.0, 1.0, 0.9, 0.1) for i in range(3)]

    monkeypatch.setattr(held_out, "job", rows)
    with parallel_config("threading"):
        one, two = (measure(Options(10, methods="learned", jobs=jobs))["learned"] for jobs in (1, 2))
    assert one == two and len(one) == 12


def test_a_method_answers_every_step_and_is_asked_where_nothing_is(group):
    matcher = make_matcher("registration", BUNDLED)
    elsewhere = group[0].shown.observations[-1]
    *rows, absent = predict("registration", matcher, "0-0", group, elsewhere)
    assert [row.step for row in rows] == [example.step for example in group]
    assert absent.absent and absent.position is None and 0 <= absent.confidence <= 1
    assert all(np.isfinite(row.position) and 0 <= row.region_iou <= 1 for row in rows)


def test_a_kind_that_there_is_not_is_refused_and_the_accepted_ones_named():
    with pytest.raises(InvalidInput, match=r"kinds.*juggle.*unpack"):
        measure(Options(families="training", kinds="keep,juggle"))
