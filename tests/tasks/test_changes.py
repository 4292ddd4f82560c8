"""What a changed scene has in common with the unchanged one, and what not."""

import numpy as np
import pytest

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.geometry.cloud import fuse
from imop.geometry.neighbours import nearest
from imop.sim.cameras import CAMERAS, TWO_CAMERAS, observe
from imop.tasks.changes import FACTORS, SCENE, Change, changes_of, factors_of, read_factors
from imop.tasks.checks import overlaps, settle
from imop.tasks.env import make_task
from imop.tasks.expert import perform
from imop.tasks.suites import find_task
from imop.tasks.task import make_scene

POT, CUBES = "tabletop/lid_off_pot", "tabletop/stack_cubes"
SEED = 3


def change(factors, name=POT, seed=SEED, instance=0):
    return Change.of(factors, name, 0, instance, seed)


def scene(factors="", name=POT):
    task, changed = make_task(name), change(factors, name)
    return task, make_scene(task, 0, 0, SEED, changed), changed


@pytest.fixture(scope="module")
def plain():
    return scene()[1]


def views(world):
    return observe(world).views.values()


def test_lists_of_factors_are_read_in_one_order_without_repetition():
    assert read_factors("d415, light,light") == ("light", "d415")
    assert read_factors("all,d415") == (*SCENE, "d415") and read_factors("") == ()
    with pytest.raises(InvalidInput, match=r"lihgt.*object_color.*fewer_cameras"):
        read_factors("light,lihgt")


def test_things_that_are_told_by_their_colours_keep_them():
    kinds = {name: find_task(name) for name in (POT, CUBES)}
    assert "object_color" in factors_of(kinds[POT])
    assert changes_of(kinds, "object_color,d415") == {POT: ("object_color", "d415"), CUBES: ("d415",)}
    with pytest.raises(InvalidInput, match=r"stack_cubes.*light"):
        changes_of({CUBES: kinds[CUBES]}, "object_color")


@pytest.mark.parametrize("factor", ["light", "table_color", "object_color"])
def test_colours_change_and_depth_does_not(plain, factor):
    changed = scene(factor)[1]
    for a, b in zip(views(plain), views(changed), strict=True):
        assert np.array_equal(a.depth, b.depth)
    assert any(not np.array_equal(a.rgb, b.rgb) for a, b in zip(views(plain), views(changed), strict=True))


def test_only_what_is_acted_on_is_painted(plain):
    changed = scene("object_color")[1]
    lid = plain.model.body("lid/body").id
    for a, b in zip(views(plain), views(changed), strict=True):
        other = np.any(a.rgb != b.rgb, axis=2)
        assert set(np.unique(a.instance_ids[other])) <= {lid}


def test_distractors_leave_everything_where_it_is_and_touch_nothing(plain):
    _, world, _ = scene("distractors")
    further = [n for n in map(world.instance_names.get, world.instance_names) if n.startswith("distractor")]
    assert further
    bodies = [plain.model.body(i).name for i in range(plain.model.nbody)]
    for body in bodies:
        assert se3.near(plain.pose(body), world.pose(body), 1e-6, 1e-5), body
    assert overlaps(world) is None
    before = {body: world.pose(body) for body in (*bodies, *further)}
    settle(world)
    assert all(se3.near(world.pose(body), T, 0.003, 0.03) for body, T in before.items())


def test_moved_cameras_see_the_same_surfaces(plain):
    here, there = (fuse(seen).points for seen in (observe(plain), change("camera_pose").tested(plain, 0)))
    assert not np.array_equal(here, there)
    on_table = there[(there[:, 2] > 0.745) & (np.abs(there[:, :2] - (0.25, 0)) < (0.25, 0.35)).all(axis=1)]
    assert len(on_table) > 1000 and np.median(nearest(on_table, here)[0]) < 0.006


def test_the_demonstration_is_seen_by_cameras_in_their_places():
    for factor in SCENE:
        shown = change(factor).shown
        assert shown.cameras == CAMERAS and not shown.T_camera_told and shown.noise is None


def test_a_set_up_has_one_calibration():
    first, second = change("calibration"), change("calibration", seed=SEED + 1)
    other = change("calibration", instance=1)
    for name, error in first.shown.T_camera_told.items():
        assert np.array_equal(error, first.tested.T_camera_told[name])
        assert np.array_equal(error, second.tested.T_camera_told[name])
        assert not np.allclose(error, other.shown.T_camera_told[name])
    assert first.shown.T_camera_told.keys() == CAMERAS.keys()


def test_knocked_cameras_were_elsewhere_in_the_demonstration():
    assert not change("knocked").shown.T_camera_told
    both = change("calibration,knocked")
    assert not any(
        np.allclose(error, both.tested.T_camera_told[name])
        for name, error in both.shown.T_camera_told.items()
    )


def test_a_camera_is_missing_in_demonstration_and_test():
    few = change("fewer_cameras,camera_pose")
    assert (
        list(few.shown.cameras) == list(few.tested.cameras) == [c for c in CAMERAS if c != "right_shoulder"]
    )


def test_two_cameras_are_all_there_is_and_their_errors_are_those_of_the_set_up():
    rig = change("two_cameras,calibration,d415")
    assert rig.shown.cameras == rig.tested.cameras == TWO_CAMERAS
    assert rig.shown.T_camera_told.keys() == TWO_CAMERAS.keys()
    for name, error in rig.shown.T_camera_told.items():
        assert np.array_equal(error, rig.tested.T_camera_told[name])


def test_two_cameras_see_the_same_surfaces_as_the_four_do(plain):
    seen = change("two_cameras").tested(plain, 0)
    assert all(view.depth.shape == (480, 640) for view in seen.views.values())
    there = fuse(seen).points
    on_table = there[(there[:, 2] > 0.745) & (np.abs(there[:, :2] - (0.25, 0)) < (0.25, 0.35)).all(axis=1)]
    few = on_table[:: len(on_table) // 1000]
    assert np.median(nearest(few, fuse(observe(plain)).points)[0]) < 0.006


def test_noise_of_the_test_is_not_that_of_the_demonstration(plain):
    noisy = change("d415")
    a, b = (sensing(plain, 0).views["front"].depth for sensing in (noisy.shown, noisy.tested))
    assert not np.array_equal(a, b)


def test_the_same_seeds_make_the_same_change():
    everything = ",".join(FACTORS)
    (_, a, changed), (_, b, again) = scene(everything), scene(everything)
    for seen, other in zip(
        changed.tested(a, 1).views.values(), again.tested(b, 1).views.values(), strict=True
    ):
        assert np.array_equal(seen.rgb, other.rgb) and np.array_equal(seen.depth, other.depth)
        assert np.array_equal(seen.T_world_camera, other.T_world_camera)
    another = change(everything, seed=SEED + 1)
    assert another.tested.cameras["left"] is not changed.tested.cameras["left"]


@pytest.mark.parametrize("name", [POT, CUBES])
def test_the_expert_succeeds_when_all_is_changed(name):
    task, world, _ = scene("all", name)
    perform(task, world)
    assert task.success(world)
