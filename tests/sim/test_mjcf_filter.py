import mujoco
import numpy as np
import pytest

from imop.errors import InvalidInput
from imop.geometry import se3
from imop.sim.mjcf_filter import mjcf_self_filter

ARM = """
<mujoco>
  <asset><mesh name="wedge" vertex="0 0 0  .1 0 0  0 .1 0  0 0 .1"/></asset>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 .1"/>
    <body name="ball" pos="0 0 1"><freejoint/><geom size=".1"/></body>
    <body name="base" pos="1 0 0">
      <body name="arm"><joint name="turn" axis="0 0 1"/>
        <geom type="capsule" fromto="0 0 .5 .5 0 .5" size=".05"/>
        <body name="finger" pos=".5 0 .5">
          <joint name="slide" type="slide" axis="0 0 1" range="0 .2" limited="true"/>
          <geom type="mesh" mesh="wedge"/>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


@pytest.fixture(scope="module")
def arm() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(ARM)


def test_only_the_tree_of_the_joints_is_robot(arm):
    """Floor and ball of the same model are scene; planes and free bodies do not disturb."""
    found = mjcf_self_filter(arm, ["turn"], ["slide"], margin=0.0)
    turned = np.array([np.pi / 2])
    points = np.array([[1, 0.25, 0.54], [1, 0.25, 0.56], [1.25, 0, 0.5], [0, 0, 1], [0, 0, 0]])
    assert found.is_robot(points, turned).tolist() == [True, False, False, False, False]


def test_meshes_count_with_their_hulls_and_fingers_with_their_range(arm):
    found = mjcf_self_filter(arm, ["turn"], ["slide"], margin={"": 0.0, "finger": 0.001})
    wedge = np.array([[1.53, 0.02, 0.53]])
    lifted = wedge + np.array([0, 0.005, 0.2])
    q = np.zeros(1)
    assert found.is_robot(wedge, q, 0.0).all()
    assert not found.is_robot(wedge + np.array([0, 0.06, 0.03]), q, 0.0).any()
    assert found.is_robot(lifted, q, 1.0).all()
    assert not found.is_robot(lifted, q, 0.0).any()


def test_moves_with_the_base(arm, rng):
    T = se3.make(se3.euler(0.3, -0.2, 1.0), (0.5, -1.0, 0.2))
    points = rng.uniform((0.8, -0.7, 0.2), (1.8, 0.7, 0.9), (5000, 3))
    q = np.array([0.4])
    here = mjcf_self_filter(arm, ["turn"], ["slide"]).is_robot(points, q)
    there = mjcf_self_filter(arm, ["turn"], ["slide"], T_world_model=T).is_robot(se3.apply(T, points), q)
    assert 0 < here.sum() < len(points)
    np.testing.assert_array_equal(here, there)


def test_unknown_names_are_refused(arm):
    for arguments in (
        {"joint_names": ["elbow"]},
        {"joint_names": []},
        {"joint_names": ["turn"], "fingers": ["thumb"]},
        {"joint_names": ["turn"], "margin": {"ball": 0.1}},
    ):
        with pytest.raises(InvalidInput):
            mjcf_self_filter(arm, **arguments)


OPPOSED = """
<mujoco><worldbody><body name="base"><joint name="turn" axis="0 0 1"/>
  <geom type="box" size=".05 .1 .02" pos="0 0 .2"/>
  <body name="left" pos="0 0 .1"><joint name="l" type="slide" axis="0 1 0" range="0 .04"/>
    <geom type="box" size=".01 .005 .05" pos="0 .005 0"/></body>
  <body name="right" pos="0 0 .1"><joint name="r" type="slide" axis="0 1 0" range="-.04 0"/>
    <geom type="box" size=".01 .005 .05" pos="0 -.005 0"/></body>
</body></worldbody></mujoco>
"""


def test_opposed_fingers_have_ranges_of_their_own():
    model, q = mujoco.MjModel.from_xml_string(OPPOSED), np.zeros(1)
    fingers = {"l": (0.0, 0.04), "r": (0.0, -0.04)}
    found = mjcf_self_filter(model, ["turn"], fingers)
    pads = np.array([(0, 0.045, 0.06), (0, -0.045, 0.06)])
    assert found.is_robot(pads, q, 1.0).all() and not found.is_robot(pads, q, 0.0).any()


def test_a_held_block_stays_in_the_cloud(rng):
    """4 cm between the fingers: all of its faces, but those that the fingers touch, are seen."""
    model, q = mujoco.MjModel.from_xml_string(OPPOSED), np.zeros(1)
    found = mjcf_self_filter(model, ["turn"], {"l": (0.0, 0.04), "r": (0.0, -0.04)})
    block = rng.uniform(-0.02, 0.02, (2000, 3))
    block[np.arange(2000), rng.integers(0, 3, 2000)] = rng.choice([-0.02, 0.02], 2000)
    free = np.abs(block[:, 1]) < 0.018
    assert not found.is_robot(block + np.array([0, 0, 0.06]), q, 0.5)[free].any()
