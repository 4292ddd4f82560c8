"""A result.json leads back to what it was made of."""

import json
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

from imop.demos.store import DemonstrationStore
from imop.errors import CorruptData, ImopError
from imop.evaluation.trials import Trial
from imop.types import Demonstration, Keyframe
from imop.viewing import cases
from imop.viewing.cases import Case, from_result
from tests.viewing.scenes import ACTIONS, demonstrated_scene

PREDICTED = {
    "method": "replay",
    "demo_episode": 0,
    "query_episode": 0,
    "base": None,
    "robot": "panda",
    "weights": None,
}


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    seen = demonstrated_scene().observation
    made = DemonstrationStore.create(tmp_path_factory.mktemp("recorded") / "demos.zarr")
    made.append(Demonstration(tuple(Keyframe(seen, action) for action in ACTIONS), seen))
    return made.path


def written(tmp_path, result):
    path = tmp_path / "result.json"
    path.write_text(json.dumps(result))
    return path


def test_of_a_prediction_both_recordings_are_read_again(tmp_path, store):
    path = written(tmp_path, {**PREDICTED, "demo": str(store), "query": str(store), "steps": []})
    case = from_result(path)
    assert case.method == "replay" and case.steps == 1 and len(case.demonstration) == 2
    assert np.allclose(case.world.known(), ACTIONS[0].T_world_gripper)


@pytest.mark.parametrize("demo", [None, "some/store"])
def test_of_an_episode_the_same_trial_is_made_again(tmp_path, monkeypatch, demo):
    trial = Trial("tabletop/lid_off_pot", 7, 0, 3, "light", 2)
    made = []

    def simulated(*given):
        made.append(given)
        return Case(None, None, given[2])

    monkeypatch.setattr(cases, "simulated", simulated)
    told = {"method": "registration", "demo": demo, "demo_episode": 4, "weights": "mine", "steps": [1, 2]}
    case = from_result(written(tmp_path, {**asdict(trial), **told}))
    shown = None if demo is None else (Path(demo), 4)
    assert made == [(trial, shown, "registration", Path("mine"))]
    assert case.steps == 2


@pytest.mark.parametrize(
    "content", ["", "[]", "{}", "null", '{"method": 3}', '{"weights": null, "demo": null, "steps": []}']
)
def test_what_is_no_result_is_refused(tmp_path, content):
    path = tmp_path / "result.json"
    path.write_text(content)
    with pytest.raises(CorruptData, match="imop run"):
        from_result(path)


def test_a_recording_that_is_gone_is_named(tmp_path):
    path = written(tmp_path, {**PREDICTED, "demo": "gone.zarr", "query": "gone.zarr", "steps": []})
    with pytest.raises(ImopError, match=r"gone\.zarr"):
        from_result(path)
