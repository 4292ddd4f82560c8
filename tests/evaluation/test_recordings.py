import pytest

from imop.errors import InvalidInput
from imop.evaluation import recordings as module
from imop.evaluation import trials
from imop.evaluation.recordings import Recordings, objects_world
from imop.evaluation.trials import DEMONSTRATION_SEED, Trial
from imop.files import user_cache
from imop.tasks.expert import ExpertFailed

POT = Trial("tabletop/lid_off_pot", seed=3, instance=1)


def same(a, b):
    poses = [
        [k.action.T_world_gripper.tobytes() + k.T_world_object.tobytes() for k in d.keyframes] for d in (a, b)
    ]
    return poses[0] == poses[1] and dict(a.seeds) == dict(b.seeds)


def never(*_):
    raise AssertionError("was recorded already")


def test_scenes_are_recorded_once(tmp_path, monkeypatch):
    first = Recordings(tmp_path, POT.task)
    scene, shown = first.scene(POT), first.demonstration(POT)
    assert scene.seeds == {"instance": 1, "episode": 3}
    assert shown.seeds["instance"] == 1 and shown.seeds["episode"] >= DEMONSTRATION_SEED
    monkeypatch.setattr(module, "record_demonstration", never)
    monkeypatch.setattr(module, "demonstration_for", never)
    for recordings in (first, Recordings(tmp_path, POT.task)):
        assert same(recordings.scene(POT), scene)
        assert same(recordings.demonstration(POT), shown)


def test_other_code_records_again(tmp_path, monkeypatch):
    monkeypatch.setattr(trials, "code_digest", lambda *packages: "old")
    monkeypatch.setattr(module, "record_demonstration", lambda *_: fails())
    assert Recordings(tmp_path, POT.task).scene(POT) is None
    monkeypatch.setattr(trials, "code_digest", lambda *packages: "new")
    monkeypatch.setattr(module, "record_demonstration", never)
    with pytest.raises(AssertionError):
        Recordings(tmp_path, POT.task).scene(POT)


def test_an_edit_of_ones_own_task_records_again_and_leaves_ours(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    own = Trial("lids_of_mine:Lid", seed=3, instance=1)
    source = tmp_path / "lids_of_mine.py"
    source.write_text("from imop.tasks.tabletop.lid_off_pot import LidOffPot\nclass Lid(LidOffPot): pass\n")
    monkeypatch.setattr(module, "record_demonstration", lambda *_: fails())
    for trial in (own, POT):
        assert Recordings(tmp_path, trial.task).scene(trial) is None
    source.write_text(source.read_text() + "# edited\n")
    monkeypatch.setattr(module, "record_demonstration", never)
    assert Recordings(tmp_path, POT.task).scene(POT) is None
    with pytest.raises(AssertionError):
        Recordings(tmp_path, own.task).scene(own)


def fails():
    raise ExpertFailed("task", 1, "no_path")


def test_what_the_expert_fails_at_is_not_tried_again(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "record_demonstration", lambda *_: fails())
    assert Recordings(tmp_path, POT.task).scene(POT) is None
    monkeypatch.setattr(module, "record_demonstration", never)
    assert Recordings(tmp_path, POT.task).scene(POT) is None


def test_the_objects_are_those_of_the_trial():
    poses = [objects_world(Trial("tabletop/stack_cubes", seed, 9)).model.geom_size for seed in (0, 1)]
    assert (poses[0] == poses[1]).all()
    with pytest.raises(InvalidInput, match="task"):
        objects_world(Trial("tabletop/nothing", 0))


def test_the_cache_is_the_users(monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", "/somewhere")
    assert str(user_cache()) == "/somewhere/imop"
