"""A small model of our own, and the real files where they are."""

from pathlib import Path

import numpy as np
import pytest

from imop.tasks.coppelia.reader import read_model
from tests.conftest import shared
from tests.tasks.coppelia import writer

HALF_TURN = (0, 0, 0, 1)  # w x y z: about z
TABLE = 0.752


def cupboard(**compress):
    """A cupboard with a drawer, a sensor in it, a free ball that belongs to it, and a spawn boundary."""
    box = writer.box_mesh()
    flat = np.array([[-0.2, -0.2, 0], [0.2, -0.2, 0], [0.2, 0.2, 0], [-0.2, 0.2, 0]])
    area = writer.item("Gst", writer.leaf(1, 1, (0.4, 0.4, 0), flags=4))
    return writer.ttm(
        writer.arrays(box, (flat, [[0, 1, 2], [0, 2, 3]])),
        writer.shape("drawer", 4, 3, p=(0, 0, 0.05), dynamic=True),
        writer.dummy("cupboard", 1, base=True, p=(0.25, 0, TABLE)),
        writer.shape("frame", 2, 1, p=(0, 0, 0.05), q=HALF_TURN),
        writer.joint("slide", 3, 2, p=(0.2, 0, 0), q=0.1),
        writer.sensor("inside", 5, 4, p=(0, 0, 0.06)),
        writer.dummy("waypoint0", 6, 4, p=(0, 0, 0.2), extension="open_gripper()"),
        writer.shape("ball", 7, 2, p=(-0.2, 0.3, 0), dynamic=True),
        writer.shape("area", 8, 1, area, respondable=False),
        **compress,
    )


@pytest.fixture
def cupboard_bytes():
    return cupboard()


@pytest.fixture
def cupboard_model():
    return read_model(cupboard())


@pytest.fixture(scope="session")
def rlbench_models() -> Path:
    """Folder of RLBench's model files, which may not be copied into the repository."""
    return shared("rlbench_ttm")
