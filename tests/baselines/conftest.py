import numpy as np
import pytest

from imop.baselines.samples import POINTS, Samples
from imop.geometry import se3

TINY = {
    "views": {"pixels": 16, "patch": 4, "width": 48, "heads": 2, "apart": 1, "together": 1, "missed": 0.02},
    "points": {"width": 48, "layers": 1, "asking": 1, "groups": (64, 16), "near": (16, 32), "ghosts": 64},
}


def some_samples(count=2, episodes=1, seed=0):
    """Samples whose target lies at a red ball on a grey floor; the demonstrations say different words."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-0.5, 0.5, (count, POINTS, 3))
    points[..., 2] = -0.3
    colors = np.full((count, POINTS, 3), 128, np.uint8)
    pose = np.stack([se3.make(se3.euler(np.pi, 0, a), p) for a, p in _poses(rng, count)])
    ball = POINTS // 4
    points[:, :ball] = pose[:, None, :3, 3] + rng.normal(0, 0.02, (count, ball, 3))
    colors[:, :ball] = (255, 0, 0)
    return Samples(
        points=np.round((points.clip(-0.5, 0.5) + 0.5) * (2**16 - 1)).astype(np.uint16),
        colors=colors,
        gripper=np.tile(se3.make(se3.euler(np.pi), (0, 0, 0.2)).astype(np.float32), (count, 1, 1)),
        opening=np.ones(count, np.float32),
        step=np.arange(count),
        pose=pose.astype(np.float32),
        gripper_open=np.arange(count) % 2 == 0,
        allow_collisions=np.arange(count) % 2 == 1,
        episode=np.arange(count) % episodes,
        instructions=tuple(f"take the {n % 2} ball" for n in range(episodes)),
    )


def _poses(rng, count):
    return [(rng.uniform(-1, 1), rng.uniform((-0.3, -0.3, -0.25), (0.3, 0.3, 0.1))) for _ in range(count)]


@pytest.fixture(params=["views", "points"])
def kind(request):
    return request.param
