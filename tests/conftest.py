"""Fixtures shared by all tests."""

from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import settings

settings.register_profile("imop", deadline=None, max_examples=40, derandomize=True)
settings.load_profile("imop")

# Tests run in parallel processes, whose threads would only wait for each other.
torch.set_num_threads(1)

SHARED = Path(__file__).resolve().parents[2] / "shared"


def shared(name: str) -> Path:
    """A folder of the shared data; the test is skipped where it is missing."""
    path = SHARED / "data" / name
    if not path.is_dir():
        pytest.skip(f"{name} may not be redistributed; looked for {path}")
    return path


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(0)


@pytest.fixture(scope="session")
def rlbench_demos() -> Path:
    """Folder of real RLBench demonstrations, which may not be redistributed."""
    return shared("rlbench_demos")
