import json
import os
import shutil
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from imop.demos.rlbench import read_episode
from imop.demos.store import DemonstrationStore
from imop.errors import CorruptData, InvalidInput
from imop.types import Action, CameraView, Demonstration, Keyframe, Match, Observation
from tests.demos.scenes import assert_same, lift_a_cube, with_observations

REPOSITORY = Path(__file__).resolve().parents[2]


@pytest.fixture
def store(tmp_path):
    return DemonstrationStore.create(tmp_path / "store")


@pytest.fixture(scope="module")
def two_episodes(tmp_path_factory):
    made = DemonstrationStore.create(tmp_path_factory.mktemp("stores") / "store")
    made.append(lift_a_cube())
    made.append(replace(lift_a_cube(), variation=5))
    return made.path


@pytest.fixture
def copy(two_episodes, tmp_path):
    shutil.copytree(two_episodes, tmp_path / "copy")
    return tmp_path / "copy"


def test_round_trip(store):
    assert len(store) == 0
    assert store.append(lift_a_cube()) == 0
    assert store.append(lift_a_cube().stripped()) == 1
    reopened = DemonstrationStore.open(store.path)
    assert len(reopened) == 2
    assert_same(reopened[0], lift_a_cube())
    assert_same(reopened[-1], lift_a_cube().stripped())
    assert [d.task for d in reopened] == ["test/lift", ""]
    lift = lift_a_cube()
    assert reopened.aims()[0] == (lift.task, lift.variation, lift.seeds["instance"])
    assert reopened.aims()[1] == ("", reopened[1].variation, -1)
    for outside in (2, -3):
        with pytest.raises(IndexError):
            reopened[outside]


def test_real_demonstration(store, rlbench_demos):
    folder = rlbench_demos / "open_drawer" / "all_variations" / "episodes" / "episode4"
    demonstration = read_episode(folder)
    store.append(demonstration)
    assert_same(store[0], demonstration)
    pixels = sum(v.rgb.nbytes + v.depth.nbytes for v in demonstration.final.views.values()) * 4
    on_disk = sum(p.stat().st_size for p in store.path.rglob("*") if p.is_file())
    assert on_disk < 0.5 * pixels


poses = st.builds(
    lambda seed: _random_pose(np.random.default_rng(seed)),
    st.integers(0, 2**32 - 1),
)


def _random_pose(rng):
    from scipy.spatial.transform import Rotation

    T = np.eye(4)
    T[:3, :3] = Rotation.random(rng=rng).as_matrix()
    T[:3, 3] = rng.normal(size=3)
    return T


@st.composite
def views(draw):
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    size = draw(st.sampled_from([(2, 3), (4, 4)]))
    depth = rng.normal(size=size).astype(np.float32)
    depth.flat[0] = draw(st.sampled_from([np.nan, np.inf, -0.0, 1e-45]))
    ids = rng.integers(-(2**31), 2**31, size, dtype=np.int32) if draw(st.booleans()) else None
    K = np.array([[draw(st.floats(0.1, 1e3)), 0, 1], [0, 2, 1], [0, 0, 1]])
    return CameraView(rng.integers(0, 256, (*size, 3), np.uint8), depth, K, draw(poses), ids)


@st.composite
def some_observations(draw):
    cameras = draw(st.lists(st.sampled_from("abcd"), min_size=1, max_size=3, unique=True))
    joints = st.none() | st.lists(st.floats(allow_nan=False, allow_infinity=False), max_size=8)
    return Observation(
        {name: draw(views()) for name in cameras},
        draw(poses),
        draw(st.floats(0, 1)),
        draw(st.integers(0, 9)),
        draw(joints),
        draw(joints),
        draw(st.none() | st.dictionaries(st.integers(-5, 2**31), st.text(max_size=4), max_size=3)),
    )


@st.composite
def demonstrations(draw):
    steps = tuple(
        Keyframe(
            draw(some_observations()),
            Action(draw(poses), draw(st.booleans()), draw(st.booleans()), draw(st.floats(0, 1))),
            draw(st.none() | st.text(max_size=3)),
            draw(st.none() | poses),
        )
        for _ in range(draw(st.integers(1, 3)))
    )
    return Demonstration(
        steps,
        draw(some_observations()),
        draw(st.text(max_size=5)),
        draw(st.integers(0, 2**40)),
        tuple(draw(st.lists(st.text(max_size=5), max_size=3))),
        draw(st.dictionaries(st.text(max_size=3), st.integers(), max_size=3)),
    )


@settings(max_examples=15)
@given(demonstrations())
def test_round_trip_of_anything(tmp_path_factory, demonstration):
    made = DemonstrationStore.create(tmp_path_factory.mktemp("any") / "store")
    made.append(demonstration)
    assert_same(made[0], demonstration)


def test_predictions_are_not_demonstrations(store):
    point = np.zeros((1, 3))
    demonstration = lift_a_cube()
    first = demonstration.keyframes[0]
    predicted = replace(first.action, match=Match(0, point, point, point))
    with pytest.raises(InvalidInput, match=r"action\.match"):
        store.append(replace(demonstration, keyframes=(replace(first, action=predicted),)))
    assert len(store) == 0


def test_create_touches_nothing_that_exists(tmp_path, two_episodes):
    (tmp_path / "notes.txt").write_text("mine")
    for path in (tmp_path, tmp_path / "notes.txt", two_episodes, "memory://store"):
        with pytest.raises(InvalidInput, match="path"):
            DemonstrationStore.create(path)
    assert len(DemonstrationStore.open(two_episodes)) == 2


def test_open_what_is_no_store(tmp_path):
    import zarr

    zarr.create_group(tmp_path / "other")
    (tmp_path / "empty").mkdir()
    (tmp_path / "file").write_text("")
    for name in ("other", "empty", "file", "nowhere"):
        with pytest.raises(InvalidInput, match="path"):
            DemonstrationStore.open(tmp_path / name)


def test_version_is_checked(copy):
    description = json.loads((copy / "zarr.json").read_text())
    description["attributes"]["version"] = 99
    (copy / "zarr.json").write_text(json.dumps(description))
    with pytest.raises(CorruptData, match="version 99"):
        DemonstrationStore.open(copy)


def as_version_1(store):
    """The store as imop wrote it before episodes had a digest."""
    for file in (store / "zarr.json", *store.glob("episode_*/zarr.json")):
        description = json.loads(file.read_text())
        description["attributes"].pop("digest", None)
        if "version" in description["attributes"]:
            description["attributes"]["version"] = 1
        file.write_text(json.dumps(description))


def test_stores_of_version_1_can_be_read_and_continued(copy):
    as_version_1(copy)
    store = DemonstrationStore.open(copy)
    assert_same(store[0], lift_a_cube())
    store.append(lift_a_cube())
    assert_same(DemonstrationStore.open(copy)[2], lift_a_cube())
    assert len(store.digests()) == 2


def changed(copy, change):
    """The first episode's attributes, changed on disk."""
    file = copy / "episode_000000" / "zarr.json"
    description = json.loads(file.read_text())
    change(description["attributes"])
    file.write_text(json.dumps(description))


@pytest.mark.parametrize(
    "change",
    [
        lambda a: a["observations"][1].update(gripper_opening=0.99),
        lambda a: a["observations"][0]["views"][0].update(camera="frond"),
        lambda a: a["observations"][0]["joint_positions"].__setitem__(1, 2),
        lambda a: a["keyframes"][0].update(gripper_open=False),
        lambda a: a.update(variation=3),
        lambda a: a.pop("digest"),
        lambda a: a.update(digest=a["digest"].replace("0", "1")),
        lambda a: a["arrays"]["depth_128x128"].update(crc32=1),
    ],
)
def test_changed_attributes_are_noticed_on_opening(copy, change):
    changed(copy, change)
    with pytest.raises(CorruptData, match=r"episode_000000.*digest"):
        DemonstrationStore.open(copy)


@pytest.mark.parametrize(
    "change",
    [
        lambda a: a["arrays"]["depth_128x128"].pop("crc32"),
        lambda a: a.update(seeds=[1]),
        lambda a: a["observations"].clear(),
    ],
)
def test_changed_attributes_of_version_1_are_corrupt_data(copy, change):
    as_version_1(copy)
    changed(copy, change)
    with pytest.raises(CorruptData, match="episode_000000"):
        DemonstrationStore.open(copy)[0]


@pytest.mark.parametrize("key", ["chunk_grid", "codecs"])
def test_absurd_blocks_are_refused(copy, key):
    file = copy / "episode_000000" / "depth_128x128" / "zarr.json"
    description = json.loads(file.read_text())
    part = description[key] if key == "chunk_grid" else description[key][0]
    part["configuration"]["chunk_shape"][1] *= 10**6
    file.write_text(json.dumps(description))
    with pytest.raises(CorruptData, match="episode_000000/depth_128x128"):
        DemonstrationStore.open(copy)


def test_shapes_are_checked_on_opening(copy):
    file = next(copy.glob("episode_000001/depth_*/zarr.json"))
    description = json.loads(file.read_text())
    description["shape"][0] += 1
    file.write_text(json.dumps(description))
    with pytest.raises(CorruptData, match="episode_000001/depth_128x128"):
        DemonstrationStore.open(copy)


@pytest.mark.parametrize("lost", ["zarr.json", "depth_128x128", "depth_128x128/zarr.json"])
def test_missing_parts_are_noticed_on_opening(copy, lost):
    path = copy / "episode_000001" / lost
    shutil.rmtree(path) if path.is_dir() else path.unlink()
    with pytest.raises(CorruptData, match="episode_000001"):
        DemonstrationStore.open(copy)


def test_missing_episode(copy):
    shutil.rmtree(copy / "episode_000000")
    with pytest.raises(CorruptData, match="episode_000000 is missing"):
        DemonstrationStore.open(copy)


def chunk(store: Path, array: str) -> Path:
    (file,) = (store / "episode_000001" / array).glob("c*")
    return file


@pytest.mark.parametrize("array", ["rgb_128x128x3", "depth_128x128", "T_world_gripper_4x4"])
@pytest.mark.parametrize("kept", [0.0, 0.3, 0.95])
def test_truncated_chunk(copy, array, kept):
    content = chunk(copy, array).read_bytes()
    chunk(copy, array).write_bytes(content[: int(kept * len(content))])
    store = DemonstrationStore.open(copy)
    with pytest.raises(CorruptData, match=f"episode_000001/{array}"):
        store[1]
    assert_same(store[0], lift_a_cube())


@pytest.mark.parametrize("array", ["rgb_128x128x3", "depth_128x128", "T_world_gripper_4x4"])
def test_flipped_bits(copy, array):
    content = bytearray(chunk(copy, array).read_bytes())
    content[len(content) // 3] ^= 1
    chunk(copy, array).write_bytes(content)
    with pytest.raises(CorruptData, match=f"episode_000001/{array}"):
        DemonstrationStore.open(copy)[1]


def test_missing_chunk_is_not_read_as_zeros(copy):
    chunk(copy, "depth_128x128").unlink()
    with pytest.raises(CorruptData, match="episode_000001/depth_128x128"):
        DemonstrationStore.open(copy)[1]


def test_attributes_that_do_not_fit(copy):
    file = copy / "episode_000001" / "zarr.json"
    description = json.loads(file.read_text())
    description["attributes"]["keyframes"].pop()
    file.write_text(json.dumps(description))
    as_version_1(copy)
    with pytest.raises(CorruptData, match=r"episode_000001.*fit together"):
        DemonstrationStore.open(copy)[1]


# The writer kills itself, at the moment named by its second argument, while it appends a second episode.
WRITER = """
import os, signal, sys
import zarr
import imop.demos.store as module
from tests.demos.scenes import lift_a_cube

store = module.DemonstrationStore.create(sys.argv[1])
store.append(lift_a_cube())

def die(*args, **kwargs):
    os.kill(os.getpid(), signal.SIGKILL)

if sys.argv[2] == "before renaming":
    os.rename = die
else:
    create, calls = zarr.Group.create_array, []
    def create_array(self, *args, **kwargs):
        calls.append(1)
        if len(calls) > int(sys.argv[2]):
            die()
        return create(self, *args, **kwargs)
    zarr.Group.create_array = create_array
store.append(lift_a_cube())
"""


@pytest.mark.parametrize("moment", ["0", "3", "before renaming"])
def test_killed_writer(tmp_path, moment):
    path = tmp_path / "store"
    env = {**os.environ, "PYTHONPATH": f"{REPOSITORY / 'src'}{os.pathsep}{REPOSITORY}"}
    writer = subprocess.run([sys.executable, "-c", WRITER, str(path), moment], env=env)
    assert writer.returncode == -signal.SIGKILL
    leftovers = list(path.glob(".writing-*"))
    assert len(leftovers) == 1 and any(leftovers[0].iterdir())

    store = DemonstrationStore.open(path)
    assert len(store) == 1
    assert_same(store[0], lift_a_cube())
    assert store.append(lift_a_cube()) == 1
    assert not list(path.glob(".writing-*"))
    assert_same(store[1], lift_a_cube())


def test_another_writer_at_work_is_left_alone(store):
    theirs = store.path / f".writing-{os.uname().nodename}-{os.getppid()}-abc"
    elsewhere = store.path / ".writing-another-host-999999999-abc"
    dead = store.path / f".writing-{os.uname().nodename}-999999999-abc"
    for folder in (theirs, elsewhere, dead):
        folder.mkdir()
    store.append(lift_a_cube())
    assert theirs.exists() and elsewhere.exists() and not dead.exists()


def test_failing_append_leaves_nothing(store, monkeypatch):
    store.append(lift_a_cube())

    def full(*args, **kwargs):
        raise OSError("no space left on device")

    monkeypatch.setattr("zarr.Group.create_array", full)
    with pytest.raises(OSError, match="space"):
        store.append(lift_a_cube())
    assert sorted(p.name for p in store.path.iterdir()) == ["episode_000000", "zarr.json"]


APPENDER = """
import sys
from dataclasses import replace
from imop.demos.store import DemonstrationStore
from tests.demos.scenes import lift_a_cube

store = DemonstrationStore.open(sys.argv[1])
for _ in range(3):
    store.append(replace(lift_a_cube(), variation=int(sys.argv[2])))
"""


def test_two_writers(store):
    env = {**os.environ, "PYTHONPATH": f"{REPOSITORY / 'src'}{os.pathsep}{REPOSITORY}"}
    command = [sys.executable, "-c", APPENDER, str(store.path)]
    writers = [subprocess.Popen([*command, str(i)], env=env) for i in range(2)]
    assert [w.wait() for w in writers] == [0, 0]
    assert sorted(d.variation for d in DemonstrationStore.open(store.path)) == [0] * 3 + [1] * 3


def test_url_is_read_only(two_episodes):
    pytest.importorskip("fsspec")
    store = DemonstrationStore.open(f"file://{two_episodes}")
    assert len(store) == 2
    assert_same(store[0], lift_a_cube())
    with pytest.raises(InvalidInput, match="URL"):
        store.append(lift_a_cube())


def test_images_of_other_sizes(store):
    def crop(k, observation):
        view = observation.views["wrist"]
        small = replace(
            view, rgb=view.rgb[:50, :60], depth=view.depth[:50, :60], instance_ids=view.instance_ids[:50, :60]
        )
        return replace(observation, views={**observation.views, "wrist": small if k % 2 else view})

    mixed = with_observations(lift_a_cube(), crop)
    store.append(mixed)
    assert_same(store[0], mixed)
