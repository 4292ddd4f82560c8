import os
import pickle
import shutil

import numpy as np
import pytest
from PIL import Image
from scipy.spatial import cKDTree

from imop.demos.low_dim import JOINT_4_OFFSET
from imop.demos.rlbench import CAMERAS, episodes, read_episode
from imop.errors import CorruptData, InvalidInput
from imop.geometry.cloud import unproject
from imop.robots.panda import tip_pose
from tests.demos.rlbench_files import FAR, KEYFRAMES, dump_demo, frames_of
from tests.demos.scenes import SYNTHETIC_CAMERAS, assert_same, lift_a_cube
from tests.demos.test_unpickle import Evil


def observations(demonstration):
    return [*(k.observation for k in demonstration.keyframes), demonstration.final]


@pytest.fixture
def episode(written, tmp_path):
    """A copy that may be damaged."""
    target = tmp_path / "lift" / "all_variations" / "episodes" / "episode0"
    shutil.copytree(written, target)
    return target


@pytest.fixture(scope="module")
def real(rlbench_demos):
    return [read_episode(folder, CAMERAS) for folder in episodes(rlbench_demos)]


def test_reads_what_was_written(written):
    read, original = read_episode(written, SYNTHETIC_CAMERAS), lift_a_cube()
    assert (read.task, read.variation, read.instructions) == ("rlbench/lift", 2, original.instructions)
    assert [k.action.gripper_open for k in read.keyframes] == [True, False, False]
    assert [k.action.allow_collisions for k in read.keyframes] == [False, False, True]
    assert all(k.object_name is None and k.T_world_object is None for k in read.keyframes)
    for k, (a, b) in enumerate(zip(observations(read), observations(original), strict=True)):
        assert a.time_step == k
        assert a.gripper_opening == pytest.approx(b.gripper_opening)
        np.testing.assert_allclose(a.T_world_gripper, b.T_world_gripper, atol=1e-12)
        np.testing.assert_allclose(a.joint_positions, b.joint_positions, atol=1e-12)
        assert list(a.views) == list(SYNTHETIC_CAMERAS)
        for name, view in a.views.items():
            expected = b.views[name]
            np.testing.assert_array_equal(view.rgb, expected.rgb)
            np.testing.assert_array_equal(view.instance_ids, expected.instance_ids)
            np.testing.assert_array_equal(view.measured, expected.measured)
            np.testing.assert_allclose(view.depth, expected.depth, atol=FAR * 2**-23)
            np.testing.assert_allclose(view.intrinsics, expected.intrinsics)
            np.testing.assert_allclose(view.T_world_camera, expected.T_world_camera, atol=1e-12)
    for step, after in zip(read.keyframes, observations(read)[1:], strict=True):
        np.testing.assert_array_equal(step.action.T_world_gripper, after.T_world_gripper)


def test_positive_focals_are_kept(episode):
    frames = frames_of(lift_a_cube())
    turn = np.diag([-1.0, -1.0, 1.0, 1.0])
    for frame in frames:
        for name in SYNTHETIC_CAMERAS:
            K = frame["misc"][f"{name}_camera_intrinsics"]
            frame["misc"][f"{name}_camera_intrinsics"] = np.abs(K)
            frame["misc"][f"{name}_camera_extrinsics"] = frame["misc"][f"{name}_camera_extrinsics"] @ turn
    before = read_episode(episode, SYNTHETIC_CAMERAS)
    dump_demo(episode / "low_dim_obs.pkl", frames)
    assert_same(read_episode(episode, SYNTHETIC_CAMERAS), before)


def test_ids_are_optional(episode):
    for name in SYNTHETIC_CAMERAS:
        shutil.rmtree(episode / f"{name}_mask")
    read = read_episode(episode, SYNTHETIC_CAMERAS)
    assert all(view.instance_ids is None for view in read.final.views.values())


def test_layouts(written, tmp_path):
    in_variation = tmp_path / "other" / "variation3" / "episodes" / "episode12"
    shutil.copytree(written, in_variation)
    (in_variation / "variation_number.pkl").unlink()
    shutil.move(in_variation / "variation_descriptions.pkl", in_variation.parents[1])
    shutil.copytree(written, tmp_path / "lift" / "all_variations" / "episodes" / "episode2")
    shutil.copytree(written, tmp_path / "lift" / "all_variations" / "episodes" / "episode10")
    names = [p.relative_to(tmp_path).as_posix() for p in episodes(tmp_path)]
    assert names == [
        "lift/all_variations/episodes/episode2",
        "lift/all_variations/episodes/episode10",
        "other/variation3/episodes/episode12",
    ]
    for level in (
        tmp_path / "lift",
        tmp_path / "lift/all_variations",
        tmp_path / "lift/all_variations/episodes",
    ):
        assert len(episodes(level)) == 2
    assert episodes(in_variation) == [in_variation]
    read = read_episode(in_variation, ["front"])
    assert (read.task, read.variation, len(read.instructions)) == ("rlbench/other", 3, 2)


def test_an_episode_linked_twice_counts_once(written, tmp_path):
    shutil.copytree(written, tmp_path / "lift" / "variation0" / "episodes" / "episode0")
    os.symlink(tmp_path / "lift" / "variation0", tmp_path / "lift" / "all_variations")
    assert len(episodes(tmp_path)) == 1


def test_no_episode(tmp_path):
    for path in (tmp_path, tmp_path / "nowhere"):
        with pytest.raises(InvalidInput, match="path"):
            episodes(path)


@pytest.mark.parametrize("cameras", [(), ("front", "back")])
def test_unknown_cameras(written, cameras):
    with pytest.raises(InvalidInput, match="cameras"):
        read_episode(written, cameras)


def damage(episode, what):
    frames = frames_of(lift_a_cube())
    low_dim = episode / "low_dim_obs.pkl"
    image = episode / "wrist_depth" / f"{KEYFRAMES[1]}.png"
    if what == "camera folder":
        shutil.rmtree(episode / "wrist_depth")
    elif what == "image":
        image.unlink()
    elif what == "truncated image":
        image.write_bytes(image.read_bytes()[:200])
    elif what == "other size":
        shutil.copy(episode / "front_depth" / "0.png", image)
        Image.open(image).resize((64, 64)).save(image)
    elif what == "one frame":
        dump_demo(low_dim, frames[:1])
    elif what == "no frame":
        dump_demo(low_dim, [])
    elif what == "os.system":
        low_dim.write_bytes(pickle.dumps(Evil(os.system, "true")))
    elif what == "not a demonstration":
        low_dim.write_bytes(pickle.dumps({"a": 1}))
    elif what == "shorter pickle":
        dump_demo(low_dim, frames[: KEYFRAMES[1] + 1])
    elif what == "no velocities":
        frames[3]["joint_velocities"] = None
        dump_demo(low_dim, frames)
    elif what == "no intrinsics":
        del frames[KEYFRAMES[0]]["misc"]["front_camera_intrinsics"]
        dump_demo(low_dim, frames)
    elif what == "shape of intrinsics":
        frames[KEYFRAMES[0]]["misc"]["front_camera_intrinsics"] = np.eye(4)
        dump_demo(low_dim, frames)
    elif what == "mirrored camera":
        frames[0]["misc"]["front_camera_extrinsics"] = np.diag([1.0, 1, -1, 1])
        dump_demo(low_dim, frames)
    elif what == "infinite camera":
        frames[0]["misc"]["front_camera_extrinsics"] = np.full((4, 4), np.inf)
        dump_demo(low_dim, frames)
    elif what == "no number":
        frames[3]["gripper_matrix"] = frames[3]["gripper_matrix"] * np.nan
        for frame in frames:
            frame["joint_velocities"] = frame["joint_velocities"] * 0
        dump_demo(low_dim, frames)
    elif what == "left-handed gripper":
        frames[KEYFRAMES[0]]["gripper_matrix"] = np.diag([1.0, 1, -1, 1])
        dump_demo(low_dim, frames)
    elif what == "no rotation":
        frames[KEYFRAMES[0]].update(gripper_matrix=None, gripper_pose=np.zeros(7))
        dump_demo(low_dim, frames)
    elif what == "planes":
        frames[0]["misc"] |= {"front_camera_near": 4.5, "front_camera_far": 0.01}
        dump_demo(low_dim, frames)
    elif what == "one finger":
        dump_demo(low_dim, [f | {"gripper_joint_positions": np.array([0.04])} for f in frames])
    elif what == "fingers in millimetres":
        dump_demo(low_dim, [f | {"gripper_joint_positions": np.full(2, 40.0)} for f in frames])
    elif what == "gripper in metres":
        dump_demo(low_dim, [f | {"gripper_open": 0.08 * f["gripper_open"]} for f in frames])
    elif what == "depth in millimetres":
        code = np.random.default_rng(0).integers(300, 3000, (128, 128))
        pixels = np.stack([0 * code, code // 256, code % 256], axis=-1).astype(np.uint8)
        Image.fromarray(pixels).save(image)
    elif what == "empty image":
        image.write_bytes(b"")
    elif what == "half mirrored focals":
        frames[0]["misc"]["front_camera_intrinsics"] = np.diag([-100.0, 100, 1])
        dump_demo(low_dim, frames)
    elif what == "variation number":
        (episode / "variation_number.pkl").write_bytes(pickle.dumps("two"))
    elif what == "descriptions":
        (episode / "variation_descriptions.pkl").unlink()


@pytest.mark.parametrize(
    ("what", "named"),
    [
        ("camera folder", "wrist_depth.*camera wrist"),
        ("image", r"wrist_depth/40\.png.*missing"),
        ("truncated image", r"wrist_depth/40\.png.*not a readable image"),
        ("other size", "camera wrist, frame 40.*depth"),
        ("one frame", "no keyframe"),
        ("no frame", "no frame"),
        ("os.system", "low_dim_obs.*system"),
        ("not a demonstration", "low_dim_obs"),
        ("shorter pickle", "60.png is beyond"),
        ("no velocities", "frame 3 has no joint_velocities"),
        ("no intrinsics", "frame 20 has no front_camera_intrinsics"),
        ("shape of intrinsics", r"front_camera_intrinsics.*\(4, 4\)"),
        ("mirrored camera", "frame 0, front_camera_extrinsics.*right-handed"),
        ("infinite camera", "frame 0: front_camera_extrinsics: not finite"),
        ("no number", "frame 3: gripper_matrix: not finite"),
        ("left-handed gripper", "frame 20, gripper_matrix.*right-handed"),
        ("no rotation", "frame 20, gripper_pose.*unit length"),
        ("planes", "frame 0: the clipping planes of camera front are 4.5 and 0.01 m"),
        ("one finger", r"frame 0: gripper_joint_positions: shape \(1,\)"),
        ("fingers in millimetres", "frame 0: gripper_joint_positions are .40.*metres"),
        ("gripper in metres", "gripper_open is at most 0.08, as a width in metres"),
        ("depth in millimetres", r"wrist_depth/40\.png.*millimetres"),
        ("empty image", r"wrist_depth/40\.png.*not a readable image"),
        ("half mirrored focals", "intrinsics"),
        ("variation number", "variation_number"),
        ("descriptions", "variation_descriptions"),
    ],
)
def test_damage_is_named(episode, what, named):
    damage(episode, what)
    with pytest.raises(CorruptData, match=named):
        read_episode(episode, SYNTHETIC_CAMERAS)


def without_velocities(episode, how):
    frames = [f | {"joint_velocities": how(f["joint_velocities"])} for f in frames_of(lift_a_cube())]
    dump_demo(episode / "low_dim_obs.pkl", frames)


@pytest.mark.parametrize("how", [lambda dq: 0 * dq, lambda dq: None])
def test_keyframes_without_joint_velocities(episode, how):
    """Near where the published rule finds them, instead of one in five frames."""
    for name in SYNTHETIC_CAMERAS:  # the images of a keyframe do for the frames around it
        for kind in ("rgb", "depth", "mask"):
            folder = episode / f"{name}_{kind}"
            for k in KEYFRAMES:
                for near in range(k - 3, min(k + 4, KEYFRAMES[-1] + 1)):
                    (folder / f"{near}.png").write_bytes((folder / f"{k}.png").read_bytes())
    before = read_episode(episode)
    without_velocities(episode, how)
    read = read_episode(episode)
    assert len(read) == len(before)
    for a, b in zip(observations(read), observations(before), strict=True):
        assert np.linalg.norm(a.T_world_gripper[:3, 3] - b.T_world_gripper[:3, 3]) < 0.01


def test_by_default_the_usual_cameras_that_were_recorded(episode):
    assert list(read_episode(episode).final.views) == list(SYNTHETIC_CAMERAS)
    for name in SYNTHETIC_CAMERAS[1:]:
        for kind in ("rgb", "depth"):
            shutil.rmtree(episode / f"{name}_{kind}")
    assert list(read_episode(episode).final.views) == ["front"]
    with pytest.raises(CorruptData, match=r"camera wrist.*recorded: front$"):
        read_episode(episode, ["front", "wrist"])
    for kind in ("rgb", "depth"):
        (episode / f"front_{kind}").rename(episode / f"overhead_{kind}")
    with pytest.raises(CorruptData, match=r"camera front.*recorded: overhead$"):
        read_episode(episode)


def test_a_camera_without_depth_is_not_left_out_silently(episode):
    shutil.rmtree(episode / "front_depth")
    with pytest.raises(CorruptData, match="front_depth"):
        read_episode(episode)


def test_numpys_numbers_are_numbers(episode):
    (episode / "variation_number.pkl").write_bytes(pickle.dumps(np.int64(3)))
    (episode / "variation_descriptions.pkl").write_bytes(pickle.dumps([np.str_("lift it")], protocol=2))
    read = read_episode(episode)
    assert (read.variation, type(read.variation)) == (3, int)
    assert read.instructions == ("lift it",) and type(read.instructions[0]) is str


def test_rounded_rotations_are_mended(episode):
    frames = frames_of(lift_a_cube())
    for frame in frames:
        frame["gripper_matrix"] = frame["gripper_matrix"].astype(np.float32)
    dump_demo(episode / "low_dim_obs.pkl", frames)
    R = read_episode(episode, ["front"]).final.T_world_gripper[:3, :3]
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)


def test_real_variations_and_actions(real):
    assert [d.variation for d in real] == [1, 0, 0, 2, 0, 0, 1, 2]
    for demonstration in real:
        assert demonstration.task == "rlbench/open_drawer"
        drawer = ("bottom", "middle", "top")[demonstration.variation]
        assert demonstration.instructions[0] == f"open the {drawer} drawer"
        assert [k.action.gripper_open for k in demonstration.keyframes] == [True, False, False]
        assert [k.action.allow_collisions for k in demonstration.keyframes] == [False, False, True]


def test_real_table_is_where_it_is(real):
    for camera in ("front", "left_shoulder", "right_shoulder", "overhead"):
        view = real[0].keyframes[0].observation.views[camera]
        table = np.isin(view.instance_ids, (48, 52))
        heights = unproject(view)[table][:, 2]
        assert len(heights) > 1000
        np.testing.assert_allclose(np.percentile(heights, [1, 99]), 0.75, atol=1e-4)


def test_real_views_coincide(real):
    """Cabinet points of the left view lie on the surface that the right view saw."""
    for demonstration in real:
        views = demonstration.keyframes[0].observation.views
        clouds = []
        for camera in ("left_shoulder", "right_shoulder"):
            cabinet = views[camera].instance_ids > 90
            clouds.append(unproject(views[camera])[cabinet])
        assert np.median(cKDTree(clouds[1]).query(clouds[0])[0]) < 0.004


def test_real_joints_explain_the_gripper(real):
    for demonstration in real:
        for observation in observations(demonstration):
            expected = tip_pose(observation.joint_positions)
            assert np.linalg.norm(expected[:3, 3] - observation.T_world_gripper[:3, 3]) < 0.004
            wrong = observation.joint_positions - JOINT_4_OFFSET * np.eye(7)[3]
            assert np.linalg.norm(tip_pose(wrong)[:3, 3] - observation.T_world_gripper[:3, 3]) > 0.01


def test_real_tip_is_between_the_fingers(real):
    for demonstration in real:
        views = demonstration.final.views.values()
        fingers = np.concatenate([unproject(v)[np.isin(v.instance_ids, (31, 34))] for v in views])
        distance = np.linalg.norm(fingers - demonstration.final.T_world_gripper[:3, 3], axis=1)
        assert distance.min() < 0.03
