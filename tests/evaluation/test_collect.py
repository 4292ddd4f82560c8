import json
import os
import signal
import subprocess
import sys
import time

import pytest
from rich.console import Console

from imop import DemonstrationStore
from imop.errors import InvalidInput, MissingExtra
from imop.evaluation import collect as module
from imop.evaluation.collect import COLLECTION_SEED, RETRY_STRIDE, collect, recorded_seeds
from imop.evaluation.splits import chosen_tasks
from imop.tasks.expert import ExpertFailed
from imop.tasks.suites import SUITES

POT = "tabletop/lid_off_pot"
QUIET = Console(quiet=True)
EPISODES = 3


def contents(store):
    """Every byte of every episode."""
    return {p.relative_to(store): p.read_bytes() for p in store.glob("episode_*/**/*") if p.is_file()}


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    path = tmp_path_factory.mktemp("one") / "demos.zarr"
    collect(path, [POT], EPISODES, 0, 1, QUIET)
    return path


def test_episodes_have_their_own_objects_and_instance_ids(store):
    demonstrations = list(DemonstrationStore.open(store))
    assert [d.seeds["instance"] for d in demonstrations] == [COLLECTION_SEED + i for i in range(EPISODES)]
    observation = demonstrations[0].keyframes[0].observation
    assert all(view.instance_ids is not None for view in observation.views.values())
    assert {"pot/body", "lid/body"} <= set(observation.instance_names.values())
    assert json.loads(store.with_suffix(".json").read_text())["episodes"] == {POT: EPISODES}


def test_two_workers_write_the_same_bytes_as_one(store, tmp_path):
    collect(tmp_path / "demos.zarr", [POT], EPISODES, 0, 2, QUIET)
    assert contents(tmp_path / "demos.zarr") == contents(store)


def test_a_killed_run_is_continued(store, tmp_path):
    path = tmp_path / "demos.zarr"
    arguments = ("--tasks", "lid_off_pot", "--episodes", str(EPISODES), "--jobs", "1", "--out", str(path))
    command = [sys.executable, "-c", "from imop.cli import main; main()", "collect", *arguments]
    with subprocess.Popen(command) as process:
        until = time.monotonic() + 60
        while not (path / "episode_000000").exists():
            assert process.poll() is None and time.monotonic() < until
            time.sleep(0.01)
        os.kill(process.pid, signal.SIGKILL)
    before = len(DemonstrationStore.open(path))
    assert 1 <= before < EPISODES
    done = collect(path, [POT], EPISODES, 0, 1, QUIET)
    assert done.recorded == EPISODES - before
    assert contents(path) == contents(store)


def test_a_finished_store_is_left_alone_and_a_larger_one_is_extended(store, monkeypatch, tmp_path):
    asked = []
    monkeypatch.setattr(module, "record", lambda key: asked.append(key))
    assert collect(store, [POT], EPISODES, 0, 1, QUIET).recorded == 0 and not asked
    done = collect(store, [POT], EPISODES + 1, 0, 1, QUIET)
    next_one = COLLECTION_SEED + EPISODES
    assert asked == [(POT, 0, next_one, next_one)] and len(done.given_up) == 1


def test_scenes_in_a_row_share_their_objects_and_variations_come_in_turn(monkeypatch, tmp_path):
    asked = []
    monkeypatch.setattr(module, "record", lambda key: asked.append(key))
    drawer, first = "tabletop/open_drawer", COLLECTION_SEED + 5
    collect(tmp_path / "demos.zarr", [drawer], 7, 5, 1, QUIET, scenes=2, in_turn=True)
    assert [variation for _, variation, _, _ in asked] == [0, 0, 1, 1, 2, 2, 0]
    assert [instance - first for _, _, instance, _ in asked] == [0, 0, 1, 1, 2, 2, 3]
    assert [scene - first for _, _, _, scene in asked] == list(range(7))


def test_a_failed_attempt_is_repeated_in_another_scene_and_counted(monkeypatch, tmp_path):
    actual = module.record_demonstration

    def fails_first(task, seed, variation, instance):
        if seed < RETRY_STRIDE:
            raise ExpertFailed(task.name, 0, "on purpose")
        return actual(task, seed, variation, instance)

    monkeypatch.setattr(module, "record_demonstration", fails_first)
    done = collect(tmp_path / "demos.zarr", [POT], 1, 7, 1, QUIET)
    assert done.failed_attempts == {POT: 1} and not done.given_up
    seeds = recorded_seeds(DemonstrationStore.open(tmp_path / "demos.zarr"))
    first = COLLECTION_SEED + 7
    assert seeds == {(POT, 0, first, first): first + RETRY_STRIDE}
    assert json.loads((tmp_path / "demos.json").read_text())["failed_attempts"] == {POT: 1}


def test_splits_do_not_overlap_and_make_up_the_suite():
    splits = SUITES["tabletop"]
    parts = [name for split in ("base", "novel", "cross_object", "real") for name in splits[split]]
    assert sorted(parts) == sorted(splits["all"]) and len(set(parts)) == len(parts)
    assert chosen_tasks("tabletop", "novel", ("lid_off_pot",)) == [POT]


@pytest.mark.parametrize(
    "choice", [("kitchen", "all", ()), ("tabletop", "old", ()), ("tabletop", "base", ("lid_off_pot",))]
)
def test_unknown_choices_are_refused(choice):
    with pytest.raises(InvalidInput):
        chosen_tasks(*choice)


@pytest.mark.parametrize(("episodes", "seed"), [(0, 0), (1, -1), (1, RETRY_STRIDE)])
def test_numbers_of_episodes_that_would_meet_other_seeds_are_refused(episodes, seed, tmp_path):
    with pytest.raises(InvalidInput, match="episodes"):
        collect(tmp_path / "demos.zarr", [POT], episodes, seed, 1, QUIET)


def test_without_ray_a_cluster_is_refused_with_the_extra_to_install(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(MissingExtra, match=r"imop\[cluster\]"):
        collect(tmp_path / "demos.zarr", [POT], 1, 0, 1, QUIET, "auto")


def test_a_ray_cluster_of_two_nodes_writes_the_same_bytes(store, tmp_path):
    ray = pytest.importorskip("ray", reason="the extra imop[cluster] is not installed")
    from ray.cluster_utils import Cluster

    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    cluster.add_node(num_cpus=1)
    try:
        collect(tmp_path / "demos.zarr", [POT], EPISODES, 0, 1, QUIET, cluster.address)
        assert len([node for node in ray.nodes() if node["Alive"]]) == 2
    finally:
        ray.shutdown()
        cluster.shutdown()
    assert contents(tmp_path / "demos.zarr") == contents(store)
