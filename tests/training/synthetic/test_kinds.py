"""What holds for every kind of thing that training draws."""

import mujoco
import numpy as np
import pytest

from imop.geometry import se3
from imop.training.synthetic.families import TRAINING
from imop.training.synthetic.stage import Stage, State

LARGEST = 0.35
RAYS = 150


def drawn(name, shape=0, color=100):
    return TRAINING[name](np.random.default_rng(shape), np.random.default_rng(color))


class Looked:
    """The uppermost body of a thing without its links, looked at along rays."""

    def __init__(self, thing):
        self.model = thing.part.compile()
        self.data = mujoco.MjData(self.model)
        mujoco.mj_kinematics(self.model, self.data)
        moved = self.model.body_weldid[self.model.geom_bodyid] != self.model.body_weldid[1]
        self.model.geom_group[moved] = 5
        self.points = np.stack(
            [se3.apply(self._pose(g), self._corners(g)) for g in np.flatnonzero(~moved)]
        ).reshape(-1, 3)

    def _pose(self, geom):
        return se3.make(self.data.geom_xmat[geom].reshape(3, 3), self.data.geom_xpos[geom])

    def _corners(self, geom):
        center, half = np.split(self.model.geom_aabb[geom], 2)
        return center + half * np.stack(np.meshgrid(*[(-1, 1)] * 3), -1).reshape(-1, 3)

    def along(self, starts, ways):
        """Distances (N,), -1 where nothing is hit, and colours (N, 4)."""
        groups, geom = np.array([1, 1, 1, 1, 1, 0], dtype=np.uint8), np.zeros(1, dtype=np.int32)
        far, colors = np.zeros(len(starts)), np.zeros((len(starts), 4))
        for i, (start, way) in enumerate(zip(starts, ways, strict=True)):
            far[i] = mujoco.mj_ray(self.model, self.data, start, way, groups, 1, -1, geom)
            colors[i] = self.model.geom_rgba[geom[0]] if geom[0] >= 0 else 0.0
        return far, colors

    def changed(self, T, rng):
        """Share of the rays that see something else once the body is moved by `T`."""
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        ways = rng.normal(size=(RAYS, 3))
        ways /= np.linalg.norm(ways, axis=1, keepdims=True)
        starts = rng.uniform(low, high, (RAYS, 3)) - ways
        plain = self.along(starts, ways)
        moved = self.along(se3.apply(T, starts), se3.rotate(T, ways))
        other = np.abs(plain[0] - moved[0]) > 0.004
        return float((other | (np.abs(plain[1] - moved[1]).max(axis=1) > 0.02)).mean())


@pytest.mark.parametrize("name", list(TRAINING))
def test_symmetries_change_nothing_that_can_be_seen(name):
    rng = np.random.default_rng(0)
    for seed in range(2):
        thing = drawn(name, seed, seed)
        looked = Looked(thing)
        np.testing.assert_allclose(thing.symmetry[0], np.eye(4), atol=1e-12)
        for T in thing.symmetry[1:][rng.permutation(len(thing.symmetry) - 1)[:4]]:
            assert looked.changed(T, rng) < 0.06, (seed, T)


@pytest.mark.parametrize("name", list(TRAINING))
def test_things_are_small_and_can_be_touched_where_they_say(name):
    for seed in range(2):
        stage = Stage([drawn(name, seed)])
        solid = stage._solid[0]
        assert np.ptp(solid, axis=0).max() < LARGEST
        poses = stage.link_poses(State(np.eye(4)[None]))
        thing = stage.things[0]
        for hold in (*thing.holds, *thing.pokes, *(moving.hold for moving in thing.moving)):
            between = (poses[0, hold.link] @ hold.T_link_gripper)[:3, 3]
            assert np.linalg.norm(solid - between, axis=1).min() < 0.02
            assert 0.0 <= hold.width <= 0.08


@pytest.mark.parametrize("name", list(TRAINING))
def test_the_colours_do_not_decide_where_a_thing_is_held(name):
    one, other = drawn(name, 3, 4), drawn(name, 3, 5)
    assert len(one.spots) == len(other.spots) and one.bends == other.bends
    np.testing.assert_array_equal(one.symmetry, other.symmetry)
    for a, b in zip((*one.holds, *one.pokes), (*other.holds, *other.pokes), strict=True):
        np.testing.assert_array_equal(a.T_link_gripper, b.T_link_gripper)
    for a, b in zip(one.moving, other.moving, strict=True):
        assert a.positions == b.positions
        np.testing.assert_array_equal(a.hold.T_link_gripper, b.hold.T_link_gripper)
