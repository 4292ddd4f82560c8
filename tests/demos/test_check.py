import pickle
import shutil
from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

from imop.demos.agreement import contradictions, find_disagreement, reordered_quaternion
from imop.demos.check import check
from imop.demos.check_steps import check_demonstration
from imop.demos.rlbench import episodes, read_episode
from imop.demos.store import DemonstrationStore
from imop.errors import InvalidInput
from imop.geometry import se3
from imop.robots.panda import tip_pose
from tests.demos.rlbench_files import KEYFRAMES, dump_demo, frames_of, write_episode
from tests.demos.scenes import lift_a_cube, with_observations, with_views

CAMERAS = ("front", "left_shoulder", "wrist")


def findings(demonstration, **options):
    return list(check_demonstration(demonstration, "demo", **options))


def only(found):
    """The one finding."""
    assert len(found) == 1, found
    return found[0]


def moved(camera, T):
    """The good demonstration with T applied behind one camera's pose."""
    return with_views(
        lift_a_cube(),
        lambda k, name, v: replace(v, T_world_camera=v.T_world_camera @ T) if name == camera else v,
    )


def scaled(cameras, factor):
    return with_views(
        lift_a_cube(),
        lambda k, name, v: replace(v, depth=v.depth * np.float32(factor)) if name in cameras else v,
    )


def test_good_data_are_good():
    assert findings(lift_a_cube(), tip_pose=tip_pose) == []
    assert findings(lift_a_cube().stripped()) == []


def test_real_data_are_good(rlbench_demos):
    assert check(rlbench_demos, tip_pose=tip_pose) == []


def test_contradictions_of_real_data_are_rare(rlbench_demos):
    """What the threshold of 2.5 % rests on."""
    for folder in episodes(rlbench_demos):
        demonstration = read_episode(folder)
        seen = [*(k.observation.views for k in demonstration.keyframes), demonstration.final.views]
        fractions = contradictions(seen)
        assert len(fractions) == 6 and max(fractions.values()) < 0.015


def test_gripper_in_millimetres():
    def change(k, o):
        T = o.T_world_gripper.copy()
        T[:3, 3] *= 1000
        return replace(o, T_world_gripper=T)

    found = findings(with_observations(lift_a_cube(), change))
    units = [f for f in found if "divide by 1000" in f.remedy]
    assert [f.where for f in units] == [f"demo, step {k}, T_world_gripper" for k in range(4)]


def test_depth_in_millimetres():
    found = findings(scaled(["front"], 1000))
    assert [f.where for f in found] == [f"demo, step {k}, camera front, depth" for k in range(4)]
    assert all("millimetres" in f.remedy and f.severity == "error" for f in found)


def test_camera_pose_in_millimetres():
    def change(k, name, view):
        T = view.T_world_camera.copy()
        T[:3, 3] *= 1000
        return replace(view, T_world_camera=T)

    assert any("camera front, T_world_camera" in f.where for f in findings(with_views(lift_a_cube(), change)))


def test_joints_in_degrees():
    degrees = with_observations(
        lift_a_cube(), lambda k, o: replace(o, joint_positions=np.rad2deg(o.joint_positions))
    )
    found = findings(degrees)
    assert len(found) == 4 and all("not degrees" in f.remedy for f in found)


@pytest.mark.parametrize("factor", [0.5, 0.95, 1.04, 1.5])
def test_scale_of_all_depths(factor):
    found = only(findings(scaled(CAMERAS, factor)))
    assert found.severity == "error" and found.where == "demo, cameras front, left_shoulder, wrist"
    cure = float(found.remedy.rsplit(" ", 1)[1])
    assert cure == pytest.approx(1 / factor, rel=0.015)


@pytest.mark.parametrize("camera", ["front", "left_shoulder"])
def test_scale_of_one_depth(camera):
    found = only(findings(scaled([camera], 1.1)))
    assert found.severity == "error" and found.where == f"demo, camera {camera}"
    assert float(found.remedy.rsplit(" ", 1)[1]) == pytest.approx(1 / 1.1, rel=0.015)


@pytest.mark.parametrize(
    "T",
    [
        se3.make(p=(0.04, 0, 0)),
        se3.make(p=(0, 0, -0.05)),
        se3.make(p=(-0.3, 0.2, 0.1)),
        se3.make(se3.euler(x=np.deg2rad(2.0))),
        se3.make(se3.euler(z=np.deg2rad(90))),
    ],
)
def test_displaced_camera(T):
    found = only(findings(moved("front", T)))
    assert found.where == "demo, camera front"
    assert "T_world_camera" in found.remedy


def test_displaced_hand_camera():
    found = findings(moved("wrist", se3.make(p=(0.05, 0, 0))))
    assert [f.where for f in found] == ["demo, camera wrist"]


def test_two_cameras_blame_both():
    pair = with_observations(
        moved("front", se3.make(p=(0.05, 0, 0))),
        lambda k, o: replace(o, views={n: o.views[n] for n in ("front", "left_shoulder")}),
    )
    assert only(findings(pair)).where == "demo, cameras front, left_shoulder"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (se3.invert, "inverted"),
        (lambda T: T @ np.diag([1.0, -1, -1, 1]), "OpenGL"),
        (lambda T: reordered_quaternion(T)[0], "in the order wxyz instead of xyzw"),
        (lambda T: reordered_quaternion(T)[1], "in the order xyzw instead of wxyz"),
    ],
)
@pytest.mark.parametrize("cameras", [CAMERAS[:1], CAMERAS[:2]])
def test_known_mistakes_of_camera_poses_are_named(change, words, cameras):
    """With one camera wrong, and with both fixed ones of a rig without a hand camera."""
    fixed = with_observations(
        lift_a_cube(),
        lambda k, o: o if len(cameras) == 1 else replace(o, views={n: o.views[n] for n in cameras}),
    )
    wrong = with_views(
        fixed,
        lambda k, n, v: replace(v, T_world_camera=change(v.T_world_camera)) if n in cameras else v,
    )
    found = [f for f in findings(wrong) if "camera" in f.where]
    assert words in only(found).remedy


def like_kinect(demonstration, seed, larger=1.0):
    """As a Kinect sees it, in a scene `larger` times as large, with poses wrong by 3 mm and 0.25 degrees.

    Depth is off by 2.85 mm at 1 m, growing with its square, half of it the same for neighbours; pixels show
    what their neighbours should; edges have holes.
    """
    rng = np.random.default_rng(seed)
    errors = {}
    for name in CAMERAS:
        p, r = (e / np.linalg.norm(e) for e in rng.normal(size=(2, 3)))
        errors[name] = se3.make(se3.euler(*np.deg2rad(0.25) * r), 0.003 * p)

    def change(k, name, view):
        z = larger * view.depth.astype(np.float64)
        edge = ndimage.maximum_filter(z, 3) - ndimage.minimum_filter(z, 3) > 0.02 * larger
        pixels = np.indices(z.shape) + np.rint(rng.normal(0, 0.5, (2, *z.shape))).astype(int)
        z = z[tuple(np.clip(pixels, 0, len(z) - 1))]
        smooth = ndimage.gaussian_filter(rng.normal(size=z.shape), 1.5)
        noise = (rng.normal(size=z.shape) + smooth / smooth.std()) / np.sqrt(2)
        z = np.where(edge & (rng.random(z.shape) < 0.3), 0, np.maximum(z + 2.85e-3 * z**2 * noise, 0))
        T = view.T_world_camera.copy()
        T[:3, 3] *= larger
        return replace(view, depth=z, T_world_camera=T @ errors[name])

    return with_views(demonstration, change)


def disagreement(demonstration):
    """Findings about cameras that contradict each other."""
    views = with_observations(demonstration, lambda k, o: replace(o, joint_positions=None))
    return [f for f in findings(views) if "contradicts" in f.problem]


@pytest.mark.parametrize("larger", [1.0, 1.6, 2.5])
@pytest.mark.parametrize("seed", range(3))
def test_good_views_of_a_real_camera_are_no_errors(seed, larger):
    found = disagreement(like_kinect(lift_a_cube(), seed, larger))
    assert not [f for f in found if f.severity == "error"]


@pytest.mark.parametrize(
    "T",
    [
        se3.make(p=(0, 0.02, 0)),
        se3.make(se3.euler(x=np.deg2rad(2.0))),
        se3.make(se3.euler(y=np.deg2rad(-2.0))),
    ],
)
def test_displaced_real_cameras_are_errors(T):
    found = disagreement(like_kinect(moved("front", T), 0))
    assert found and all(f.severity == "error" and "front" in f.where for f in found)


def test_quaternion_order_of_a_real_camera_is_named():
    wrong = with_views(
        like_kinect(lift_a_cube(), 0),
        lambda k, n, v: (
            replace(v, T_world_camera=reordered_quaternion(v.T_world_camera)[0]) if n == "front" else v
        ),
    )
    found = only([f for f in findings(wrong) if "camera front" in f.where])
    assert found.severity == "error" and "in the order wxyz instead of xyzw" in found.remedy


def test_reordering_is_what_it_says():
    T = se3.from_pose7(np.array([0, 0, 0, 0.1, 0.2, 0.3, np.sqrt(1 - 0.14)]))
    x, y, z, w = 0.1, 0.2, 0.3, np.sqrt(1 - 0.14)
    was_xyzw_read_as_wxyz = se3.from_pose7(np.array([0, 0, 0, y, z, w, x]))
    was_wxyz_read_as_xyzw = se3.from_pose7(np.array([0, 0, 0, w, x, y, z]))
    np.testing.assert_allclose(reordered_quaternion(was_xyzw_read_as_wxyz)[0], T, atol=1e-12)
    np.testing.assert_allclose(reordered_quaternion(was_wxyz_read_as_xyzw)[1], T, atol=1e-12)


@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.parametrize("with_hand_camera", [True, False])
def test_quaternion_order_of_the_gripper(order, with_hand_camera):
    def change(k, o):
        T = reordered_quaternion(o.T_world_gripper)[order]
        views = o.views if with_hand_camera else {n: v for n, v in o.views.items() if n != "wrist"}
        return replace(o, T_world_gripper=T, views=views)

    wrong = with_observations(lift_a_cube(), change)
    actions = tuple(
        replace(k, action=replace(k.action, T_world_gripper=wrong.after(i).T_world_gripper))
        for i, k in enumerate(wrong.keyframes)
    )
    found = findings(replace(wrong, keyframes=actions), tip_pose=None if with_hand_camera else tip_pose)
    assert only(found).where == "demo, T_world_gripper"
    assert "another order" in found[0].problem


def test_hand_camera_that_does_not_follow():
    shaken = with_views(
        lift_a_cube(),
        lambda k, n, v: (
            replace(v, T_world_camera=se3.make(p=(0, 0, 0.02 * k)) @ v.T_world_camera) if n == "wrist" else v
        ),
    )
    assert any("not with the gripper" in f.problem for f in findings(shaken))


def test_other_gripper_frame():
    flange = se3.make(p=(0, 0, -0.1))
    wrong = with_observations(
        lift_a_cube(), lambda k, o: replace(o, T_world_gripper=o.T_world_gripper @ flange)
    )
    found = findings(wrong, tip_pose=tip_pose)
    assert any("from where the joint positions put it" in f.problem for f in found)


def test_robot_and_cameras_in_different_frames():
    away = se3.make(p=(0, 0, 0.6))
    wrong = with_observations(
        lift_a_cube(), lambda k, o: replace(o, T_world_gripper=away @ o.T_world_gripper)
    )
    assert any("nothing was seen within" in f.problem for f in findings(wrong))


def test_missing_keyframe():
    whole = lift_a_cube()
    found = findings(replace(whole, keyframes=(whole.keyframes[0], whole.keyframes[2])))
    assert {f.where for f in found} == {"demo, time_step", "demo, step 0, action.T_world_gripper"}


def test_wrong_state_of_the_gripper():
    whole = lift_a_cube()
    first = whole.keyframes[0]
    wrong = replace(first, action=replace(first.action, gripper_open=False))
    found = findings(replace(whole, keyframes=(wrong, *whole.keyframes[1:])))
    assert only(found).where == "demo, step 0, action.gripper_open"


@pytest.mark.parametrize("nothing", [np.nan, 0.0, np.inf])
def test_depth_without_measurements(nothing):
    blind = with_views(
        lift_a_cube(),
        lambda k, n, v: replace(v, depth=np.full_like(v.depth, nothing)) if (k, n) == (1, "front") else v,
    )
    found = only(findings(blind))
    assert (found.severity, found.where) == ("error", "demo, step 1, camera front, depth")


def test_blind_camera_in_all_steps_is_not_blamed_for_more():
    blind = with_views(lift_a_cube(), lambda k, n, v: replace(v, depth=v.depth * 0) if n == "front" else v)
    assert len(findings(blind)) == 4


def test_all_cameras_blind():
    blind = with_views(lift_a_cube(), lambda k, n, v: replace(v, depth=v.depth * np.nan))
    assert len(findings(blind)) == 12


def test_missing_camera():
    partly = with_observations(
        lift_a_cube(),
        lambda k, o: o if k != 2 else replace(o, views={n: v for n, v in o.views.items() if n != "wrist"}),
    )
    found = only(findings(partly))
    assert found.where == "demo, step 2, views" and "wrist" in found.problem


def test_one_camera_is_enough():
    single = with_observations(lift_a_cube(), lambda k, o: replace(o, views={"front": o.views["front"]}))
    assert findings(single) == []
    assert find_disagreement([single.final.views]) == []


def test_store(tmp_path):
    store = DemonstrationStore.create(tmp_path / "store")
    assert "empty" in only(check(store.path)).problem
    store.append(lift_a_cube())
    assert check(store.path) == []
    store.append(scaled(["front"], 1000))
    assert all("episode_000001" in f.where for f in check(store.path))
    shutil.rmtree(tmp_path / "store" / "episode_000001" / "depth_128x128")
    found = only(check(store.path))
    assert "episode_000001/depth_128x128" in found.where and found.severity == "error"
    assert "episode_000001" in str(found) and "remedy" in str(found)


def test_nothing_to_check(tmp_path):
    with pytest.raises(InvalidInput, match="path"):
        check(tmp_path)


@pytest.fixture
def folder(tmp_path):
    return write_episode(tmp_path / "lift" / "all_variations" / "episodes" / "episode0", lift_a_cube())


def test_good_folder(folder):
    assert check(folder, CAMERAS) == []


def test_missing_camera_folder(folder):
    shutil.rmtree(folder / "wrist_depth")
    found = only(check(folder, CAMERAS))
    assert found.severity == "error" and "camera wrist" in found.where


def test_folder_without_cameras(folder):
    for name in CAMERAS:
        shutil.rmtree(folder / f"{name}_rgb")
    assert len(check(folder, CAMERAS)) == 3
    assert len(check(folder)) == 3
    for name in CAMERAS:
        shutil.rmtree(folder / f"{name}_depth")
    assert len(check(folder)) == 4


def remove(folder, camera):
    for kind in ("rgb", "depth", "mask"):
        shutil.rmtree(folder / f"{camera}_{kind}")


def test_cameras_need_not_be_there_but_must_be_in_all_episodes(folder):
    assert check(folder) == []
    for camera in CAMERAS[1:]:
        remove(folder, camera)
    assert check(folder) == []
    assert "camera wrist" in only(check(folder, ["front", "wrist"])).where
    write_episode(folder.with_name("episode1"), lift_a_cube())
    found = check(folder.parent)
    assert [f.where for f in found] == [f"{folder}, camera {c}" for c in CAMERAS[1:]]
    with pytest.raises(InvalidInput, match="cameras"):
        check(folder, ["back"])


BAD_NUMBERS = [
    {"gripper_matrix": np.full((4, 4), np.nan)},
    {"gripper_matrix": np.diag([1.0, 1, -1, 1])},
    {"gripper_pose": np.full(7, np.inf)},
    {"gripper_pose": np.zeros(7), "gripper_matrix": None},
    {"joint_positions": np.full(7, np.nan)},
    {"joint_velocities": np.full(7, np.inf)},
    {"joint_velocities": np.zeros(0)},
    {"gripper_open": np.nan},
    {"gripper_joint_positions": np.zeros(0)},
    {"gripper_joint_positions": np.array([0.04])},
    {"ignore_collisions": np.nan},
    {"misc": None},
]


@pytest.mark.parametrize("bad", BAD_NUMBERS, ids=str)
def test_one_bad_number_is_a_finding_and_the_others_are_checked(folder, bad):
    good = folder.with_name("episode1")
    write_episode(good, lift_a_cube())
    (good / "front_rgb" / f"{KEYFRAMES[1]}.png").unlink()
    frames = frames_of(lift_a_cube())
    frames[KEYFRAMES[0]] |= bad
    dump_demo(folder / "low_dim_obs.pkl", frames)
    first, second = check(folder.parent)
    assert (
        first.severity == "error" and "episode0" in first.where and f"frame {KEYFRAMES[0]}" in first.problem
    )
    assert second.where.endswith(f"episode1/front_rgb/{KEYFRAMES[1]}.png")


def test_no_frame_at_all(folder):
    dump_demo(folder / "low_dim_obs.pkl", [])
    assert "no frame" in only(check(folder)).problem


@pytest.mark.parametrize("nothing", [np.zeros(7), None])
def test_joint_velocities_that_nobody_measured(folder, nothing):
    dump_demo(
        folder / "low_dim_obs.pkl", [f | {"joint_velocities": nothing} for f in frames_of(lift_a_cube())]
    )
    found = check(folder)
    assert found[0].where.endswith("joint_velocities") and "missing or 0" in found[0].problem
    assert found[0].severity == "warning"


def test_a_damaged_episode_of_a_store_is_a_finding_and_the_others_are_checked(tmp_path):
    store = DemonstrationStore.create(tmp_path / "store")
    for factor in (1, 1, 1000):
        store.append(scaled(["front"], factor))
    (store.path / "episode_000000" / "zarr.json").write_text("{")
    (store.path / "episode_000001" / "depth_128x128" / "zarr.json").unlink()
    found = check(store.path)
    assert {f.where.split("/episode_")[1][:6] for f in found} == {"000000", "000001", "000002"}


@pytest.mark.parametrize("scale", [0.08, 0.04])
def test_gripper_opening_as_a_width_in_metres(scale):
    wrong = with_observations(
        lift_a_cube(), lambda k, o: replace(o, gripper_opening=scale * o.gripper_opening)
    )
    found = only([f for f in findings(wrong) if f.severity == "error"])
    assert found.where == "demo, gripper_opening"
    assert "width" in found.problem and "0.08" in found.remedy


def test_depth_that_is_too_near_to_be_one():
    coded = with_views(
        lift_a_cube(), lambda k, n, v: replace(v, depth=np.where(v.measured, 0.01 + v.depth / 4000, 0))
    )
    found = findings(coded)
    assert len(found) == 12 and all("depth" in f.where and f.severity == "error" for f in found)


def test_missing_image(folder):
    (folder / "front_rgb" / f"{KEYFRAMES[1]}.png").unlink()
    assert only(check(folder, CAMERAS)).where.endswith(f"front_rgb/{KEYFRAMES[1]}.png")


def test_no_keyframe(folder):
    dump_demo(folder / "low_dim_obs.pkl", frames_of(lift_a_cube())[:1])
    assert any("no keyframe" in f.problem for f in check(folder, CAMERAS))


def test_dangerous_pickle(folder):
    (folder / "low_dim_obs.pkl").write_bytes(pickle.dumps(print))
    assert "builtins.print" in only(check(folder, CAMERAS)).problem


@pytest.mark.parametrize(
    ("change", "problem", "remedy"),
    [
        (lambda pose: pose[[0, 1, 2, 6, 3, 4, 5]], "order w x y z", "x y z w"),
        (lambda pose: pose * [1000, 1000, 1000, 1, 1, 1, 1], "position differs", "metres"),
        (lambda pose: pose * [1, 1, 1, 2, 2, 2, 2], "length 2", "unit quaternion"),
    ],
)
def test_gripper_pose_against_matrix(folder, change, problem, remedy):
    frames = frames_of(lift_a_cube())
    for frame in frames:
        frame["gripper_pose"] = change(frame["gripper_pose"])
    dump_demo(folder / "low_dim_obs.pkl", frames)
    found = only(check(folder, CAMERAS))
    assert found.severity == "error" and found.where.endswith("low_dim_obs.pkl, gripper_pose")
    assert problem in found.problem and remedy in found.remedy


def test_velocities_in_degrees(folder):
    frames = frames_of(lift_a_cube())
    for frame in frames:
        frame["joint_velocities"] = frame["joint_velocities"] + 0.3
    dump_demo(folder / "low_dim_obs.pkl", frames)
    found = check(folder, CAMERAS)
    assert any(f"rests at frame {KEYFRAMES[0]}" in f.problem for f in found)
