import json

import numpy as np
import pytest
from benchmarks.reliability import Answer, Share, answers, main, measure
from PIL import Image

from imop.errors import CorruptData, InvalidInput


def answer(episode, step, confidence, right):
    return Answer((str(episode),), step, confidence, right)


def held_out(**changed):
    row = {"method": "learned", "scene": 3, "step": 0, "confidence": 0.9, "position": 0.001, "rotation": 1.0}
    return row | changed


def open_loop(**changed):
    where = {"task": "open_drawer", "variation": 0, "support": "1000000", "query": "5"}
    row = {**held_out(), **where, **changed}
    del row["scene"]
    return row


def saved(path, report):
    path.write_text(json.dumps(report))
    return path


def test_twenty_answers_in_ten_bins_have_the_error_that_is_found_by_hand():
    # Two in every bin; each bin is half right, at confidences 0.0, 0.1 .. 0.9.
    found = [answer(i, 0, i // 2 / 10 + 1e-9, i % 2 == 0) for i in range(20)]
    r = measure(found)
    assert r.right == Share(10, 20)
    assert r.confidence == pytest.approx(0.45)
    assert [b.right for b in r.bins] == [Share(1, 2)] * 10
    assert [b.confidence for b in r.bins] == pytest.approx(np.arange(10) / 10, abs=1e-6)
    # |0.5 - c|: 0.5 .. 0.1, 0, 0.1 .. 0.4.
    assert r.calibration == pytest.approx((1.5 + 1.0) / 10)


def test_the_threshold_refuses_a_twentieth_of_the_right_first_actions():
    right_first = [answer(i, 0, (i + 1) / 100, True) for i in range(40)]
    wrong_first = [answer(100 + i, 0, c, False) for i, c in enumerate((0.005, 0.02, 0.03, 0.5))]
    later = [answer(0, 1, 0.01, True), answer(0, 2, 0.01, False), answer(1, 1, 0.9, False)]
    s = measure([*right_first, *wrong_first, *later]).refusals
    # Of 40 two may be refused: 0.01 and 0.02, but not 0.03.
    assert s.threshold == pytest.approx(0.03)
    assert s.right_first == Share(2, 40)
    assert s.wrong_first == Share(2, 4)
    assert s.right == Share(3, 41)
    assert s.wrong == Share(3, 6)


def test_an_episode_begins_with_the_first_step_that_was_asked():
    found = [
        answer(0, 4, 0.2, False),
        answer(0, 2, 0.8, True),
        answer(1, 0, None, False),
        answer(1, 1, 0.1, True),
    ]
    s = measure(found).refusals
    assert s.right_first == Share(0, 1)
    assert s.wrong_first == Share(0, 0)


def test_where_the_thing_is_not_there_every_answer_is_a_wrong_first_action():
    right = [answer(i, 0, (i + 1) / 100, True) for i in range(20)]
    absent = [Answer((str(i), "absent"), 0, c, False, True) for i, c in enumerate((0.0, 0.01, 0.3))]
    alone, both = measure(right), measure([*right, *absent])
    assert both.refusals.wrong_first == both.refusals.absent == Share(2, 3)
    assert both.refusals.threshold == alone.refusals.threshold and alone.refusals.absent == Share(0, 0)
    assert (both.right, both.calibration, both.bins) == (alone.right, alone.calibration, alone.bins)


def test_without_a_right_first_action_there_is_no_threshold():
    assert measure([answer(0, 0, 0.5, False), answer(0, 1, 0.5, True)]).refusals is None


def test_silent_steps_are_counted_and_change_nothing_else():
    given = [answer(i, 0, 0.1 * (i + 1), i > 3) for i in range(8)]
    plain, silent = measure(given), measure([*given, answer(9, 0, None, False)])
    assert (plain.silent, silent.silent) == (0, 1)
    assert (plain.right, plain.calibration, plain.bins) == (silent.right, silent.calibration, silent.bins)


def test_both_kinds_of_reports_are_read(tmp_path):
    rows = [held_out(), held_out(step=1, position=0.021), held_out(step=2, rotation=10.5, confidence=0)]
    together = saved(tmp_path / "a.json", {"methods": {}, "rows": [*rows, held_out(method="registration")]})
    rows = [open_loop(), open_loop(query="6", position=None, rotation=None, confidence=None)]
    apart = saved(tmp_path / "b.json", {"methods": {"learned": {"all": {}, "rows": rows}}})
    assert answers(together, "learned") == [
        Answer(("3",), 0, 0.9, True),
        Answer(("3",), 1, 0.9, False),
        Answer(("3",), 2, None, False),
    ]
    nowhere = {"position": None, "rotation": None, "absent": True, "confidence": 0.0}
    one = saved(tmp_path / "c.json", {"rows": [held_out(**nowhere)]})
    assert answers(one, "learned") == [Answer(("3", "absent"), 0, 0.0, False, True)]
    shown = ("open_drawer", "0", "1000000")
    assert answers(apart, "learned") == [
        Answer((*shown, "5"), 0, 0.9, True),
        Answer((*shown, "6"), 0, None, False),
    ]


@pytest.mark.parametrize(
    "text", ["no JSON", "[]", '{"rows": [{"task": "open_drawer"}]}', '{"methods": {"learned": {}}}']
)
def test_other_files_are_no_reports(tmp_path, text):
    path = tmp_path / "other.json"
    path.write_text(text)
    with pytest.raises(CorruptData, match=r"held_out\.py"):
        answers(path, "learned")


def test_a_method_that_is_not_in_the_report_is_named_with_those_that_are(tmp_path):
    path = saved(tmp_path / "a.json", {"rows": [held_out()]})
    with pytest.raises(InvalidInput, match=r"textbook is not in .*learned"):
        answers(path, "textbook")


def test_the_command_writes_results_and_a_panel_for_each_report(tmp_path, monkeypatch):
    rows = [held_out(scene=i, confidence=0.05 * i + 0.01, position=0.1 if i % 3 else 0.0) for i in range(18)]
    paths = [str(saved(tmp_path / f"{name}.json", {"rows": rows})) for name in "ab"]
    widths = []
    for reports in (paths[:1], paths):
        out = ["--out", str(tmp_path / "r.png"), "--json", str(tmp_path / "r.json")]
        monkeypatch.setattr("sys.argv", ["reliability.py", *reports, *out])
        assert main() == 0
        with Image.open(tmp_path / "r.png") as image:
            widths.append(image.width)
    assert widths[1] == pytest.approx(2 * widths[0], abs=2)
    results = json.loads((tmp_path / "r.json").read_text())["results"]
    assert [r["right"] for r in results.values()] == [{"count": 6, "of": 18}] * 2
