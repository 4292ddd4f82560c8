import numpy as np

from imop.geometry import se3
from imop.geometry.neighbours import nearest
from imop.sim.cameras import CAMERAS
from imop.sim.depth_noise import DepthNoise
from imop.training.synthetic.families import TRAINING
from imop.training.synthetic.stage import Stage, State
from imop.training.synthetic.viewpoints import SHIFT, TURN, placed_cameras


def placements():
    return [placed_cameras(np.random.default_rng(seed)) for seed in range(40)]


def test_cameras_move_by_little_and_sometimes_not_at_all():
    moved = []
    for cameras in placements():
        assert list(cameras) == list(CAMERAS)
        for name, camera in cameras.items():
            usual = CAMERAS[name].T_mount_camera
            distance = se3.translation_distance(camera.T_mount_camera, usual)
            assert distance <= 2 * np.sqrt(3) * SHIFT
            assert se3.rotation_distance(camera.T_mount_camera, usual) <= 2 * np.sqrt(3) * TURN + 1e-6
            assert camera.on_gripper == CAMERAS[name].on_gripper
            moved.append(distance > 1e-4)
    assert 0.3 < np.mean(moved) < 0.9


def test_a_moved_camera_sees_the_same_scene_from_elsewhere():
    """Its pose is known: the fused clouds lie on the same surfaces, though no pixel hits the same spot."""
    rng = np.random.default_rng

    def things():
        return [TRAINING["block"](rng(1), rng(2)), TRAINING["can"](rng(3), rng(4))]

    poses = np.stack([se3.make(p=(0.2, y, 0.78)) for y in (-0.1, 0.15)])
    cameras = next(c for c in placements() if c["front"] is not CAMERAS["front"])
    here, there = (
        Stage(things(), placed).cloud(State(poses), DepthNoise(), rng(0)) for placed in (CAMERAS, cameras)
    )
    assert len(here) != len(there) or not np.array_equal(here.points, there.points)
    a, b = (c.points[c.points[:, 2] > 0.77] for c in (here, there))
    assert min(len(a), len(b)) > 50
    assert np.median(nearest(a, b)[0]) < 0.008
