import pickle
import pickletools
from dataclasses import replace

import numpy as np
import pytest

from imop.cli import main
from imop.demos import rlbench_pickle
from imop.demos.check import check
from imop.demos.export import FAR, NEAR, export_rlbench, write_episode
from imop.demos.low_dim import JOINT_4_OFFSET, read_frames
from imop.demos.rlbench import episodes, read_episode
from imop.demos.store import DemonstrationStore
from imop.errors import InvalidInput
from imop.evaluation.trials import Trial, demonstration_for

TASKS = ("tabletop/lid_off_pot", "tabletop/stack_cubes")


@pytest.fixture(scope="module")
def recorded():
    return [
        demonstration_for(Trial(task, 0, variation)) for task, variation in zip(TASKS, (0, 5), strict=True)
    ]


@pytest.fixture(scope="module")
def exported(recorded, tmp_path_factory):
    folder = tmp_path_factory.mktemp("export")
    store = DemonstrationStore.create(folder / "demos.zarr")
    for demonstration in recorded:
        store.append(demonstration)
    assert export_rlbench(store, folder / "rlbench") == len(recorded)
    return [
        folder / "rlbench" / task.split("/")[1] / "all_variations" / "episodes" / "episode0" for task in TASKS
    ]


def observations(demonstration):
    return [*(k.observation for k in demonstration.keyframes), demonstration.final]


def test_observations_come_back(recorded, exported):
    for demonstration, folder in zip(recorded, exported, strict=True):
        back = read_episode(folder)
        assert (back.variation, back.instructions) == (demonstration.variation, demonstration.instructions)
        assert len(back) == len(demonstration)
        for a, b in zip(observations(demonstration), observations(back), strict=True):
            assert np.array_equal(a.T_world_gripper, b.T_world_gripper)
            assert np.allclose(a.joint_positions, b.joint_positions, rtol=0, atol=1e-12)
            assert np.array_equal(a.joint_velocities, b.joint_velocities)
            assert (a.gripper_opening, a.time_step) == (
                pytest.approx(b.gripper_opening, abs=1e-12),
                b.time_step,
            )
            assert list(a.views) == list(b.views)
            for name in a.views:
                compare_views(name, a.views[name], b.views[name])


def compare_views(name, a, b):
    assert np.array_equal(a.rgb, b.rgb) and np.array_equal(a.instance_ids, b.instance_ids)
    assert np.array_equal(a.intrinsics, b.intrinsics)
    assert np.allclose(a.T_world_camera, b.T_world_camera, rtol=0, atol=1e-12)
    assert np.array_equal(a.measured, b.measured)
    quantum = (FAR[name] - NEAR) / (2**24 - 1)
    assert np.abs(a.depth - b.depth)[a.measured].max() < quantum


def test_actions_come_back_with_the_pose_the_gripper_had_afterwards(recorded, exported):
    for demonstration, folder in zip(recorded, exported, strict=True):
        back = read_episode(folder)
        for step, (a, b) in enumerate(zip(demonstration.keyframes, back.keyframes, strict=True)):
            assert a.action.gripper_open == b.action.gripper_open
            assert a.action.allow_collisions == b.action.allow_collisions
            assert np.array_equal(b.action.T_world_gripper, demonstration.after(step).T_world_gripper)
            assert np.allclose(b.action.T_world_gripper, a.action.T_world_gripper, atol=2e-3)


def test_exported_episodes_pass_the_check(exported):
    for folder in exported:
        assert not [finding for finding in check(folder) if finding.severity == "error"]


def test_the_pickle_names_only_what_rlbenchs_own_name(exported):
    data = (exported[0] / "low_dim_obs.pkl").read_bytes()
    strings = [argument for _, argument, _ in pickletools.genops(data) if isinstance(argument, str)]
    assert strings[:2] == ["rlbench.demo", "Demo"] and "rlbench.backend.observation" in strings
    assert "numpy.core.multiarray" in strings and not any("imop" in s or "numpy._core" in s for s in strings)


def test_rlbenchs_conventions_are_kept(recorded, exported):
    frame = read_frames(exported[0] / "low_dim_obs.pkl")[0]
    observation = recorded[0].keyframes[0].observation
    q = frame.numbers("joint_positions", (7,))
    assert q[3] == pytest.approx(observation.joint_positions[3] - JOINT_4_OFFSET)
    assert frame.numbers("front_camera_intrinsics", (3, 3))[0, 0] == pytest.approx(-175.8386, abs=1e-3)
    assert frame.number("front_camera_far") == 4.5
    quaternion = frame.numbers("gripper_pose", (7,))[3:]
    assert np.linalg.norm(quaternion) == pytest.approx(1)


def test_every_frame_has_its_images(exported):
    for folder in exported:
        n = len(read_frames(folder / "low_dim_obs.pkl"))
        for camera in ("front", "left_shoulder", "right_shoulder", "wrist"):
            for kind in ("rgb", "depth", "mask"):
                assert {int(p.stem) for p in (folder / f"{camera}_{kind}").iterdir()} == set(range(n))


def test_keyframes_are_found_after_any_pattern_of_the_gripper(recorded, tmp_path, rng):
    first = recorded[1].keyframes[0]
    small = {
        n: replace(v, rgb=v.rgb[:2, :2], depth=v.depth[:2, :2], instance_ids=None)
        for n, v in first.observation.views.items()
    }
    observation = replace(first.observation, views=small)
    for n in range(1, 25):
        steps = tuple(
            replace(first, observation=observation, action=replace(first.action, gripper_open=bool(state)))
            for state in rng.integers(0, 2, n)
        )
        write_episode(replace(recorded[1], keyframes=steps, final=observation), tmp_path / f"episode{n}")
        back = read_episode(tmp_path / f"episode{n}")
        assert [k.action.gripper_open for k in back.keyframes] == [k.action.gripper_open for k in steps]


def test_what_the_layout_cannot_hold_is_refused_and_leaves_nothing(recorded, tmp_path):
    step = recorded[0].keyframes[0]
    for wrong in (
        replace(step.observation, joint_positions=None),
        replace(step.observation, views={"kitchen": step.observation.views["front"]}),
    ):
        broken = replace(recorded[0], keyframes=(replace(step, observation=wrong),))
        with pytest.raises(InvalidInput):
            write_episode(broken, tmp_path / "episode0")
    assert not list(tmp_path.iterdir())


def test_an_existing_folder_is_never_written_into(recorded, exported):
    with pytest.raises(InvalidInput, match="already exists"):
        write_episode(recorded[0], exported[0])


def test_stand_ins_cannot_be_unpickled_by_accident_as_ours():
    with pytest.raises(ModuleNotFoundError, match="rlbench"):
        pickle.loads(rlbench_pickle.dumps(rlbench_pickle.Demo(_observations=[])))


def test_export_and_import_by_the_command_line(recorded, tmp_path, capsys):
    store = DemonstrationStore.create(tmp_path / "demos.zarr")
    store.append(recorded[0])
    for arguments in (
        ("export", "rlbench", tmp_path / "demos.zarr", tmp_path / "rlbench"),
        ("import", "rlbench", tmp_path / "rlbench", tmp_path / "back.zarr"),
    ):
        with pytest.raises(SystemExit) as stopped:
            main([str(a) for a in arguments])
        assert stopped.value.code == 0
    assert len(episodes(tmp_path / "rlbench")) == 1
    assert DemonstrationStore.open(tmp_path / "back.zarr")[0].task == "rlbench/lid_off_pot"
