"""The surface of a thing, all around."""

import numpy as np

from imop.geometry import se3
from imop.geometry.cloud import fuse
from imop.sim.cameras import Camera, look_at
from imop.training.synthetic.stage import Stage, State
from imop.types import FloatArray

_MIDDLE = np.array([0.0, 0.0, 4.0])
"""Where a thing is looked at, away from everything else, metres."""
_AWAY = se3.make(p=(3.0, 0.0, -5.0))
_VIEWS, _PIXELS, _FAR = 18, 56, 1.0
_OPENED = 0.12
"""What opens may stick out by this much, metres."""


def surface(stage: Stage, thing: int) -> dict[str, FloatArray]:
    """Link -> points (N, 3) of its outside in its own frame, as seen with all joints at either end."""
    ends: tuple[dict[tuple[int, str], float], ...] = ({}, {})
    for moving in stage.things[thing].moving:
        for joints, position in zip(ends, sorted(moving.positions), strict=True):
            joints[thing, moving.joint] = position
    looks = [_look(stage, thing, joints) for joints in (ends if ends[0] else ends[:1])]
    return {link: np.concatenate([look[link] for look in looks]) for link in stage.links[thing]}


def _look(stage: Stage, thing: int, joints: dict[tuple[int, str], float]) -> dict[str, FloatArray]:
    low, high = stage.bottom(thing), stage.top(thing)
    xy, _ = stage.footprint(thing, np.eye(3))
    radius = float(np.hypot(np.linalg.norm(xy, axis=1).max(), (high - low) / 2)) + _OPENED * bool(joints)
    poses = np.stack([_AWAY] * len(stage.things))
    poses[thing] = se3.make(p=_MIDDLE - (0, 0, (low + high) / 2))
    state = State(poses, joints)
    seen, links = fuse(stage.clean(state, _around(radius), _PIXELS)), stage.link_poses(state)
    return {
        link: se3.apply(se3.invert(links[thing, link]), seen.points[seen.ids == instance])
        for link, instance in stage.links[thing].items()
    }


def _around(radius: float) -> dict[str, Camera]:
    """Cameras all around the middle that see what is within `radius` metres of it."""
    k = np.arange(_VIEWS) + 0.5
    height, angle = 1 - 2 * k / _VIEWS, np.pi * (1 + 5**0.5) * k
    ways = np.stack([np.cos(angle), np.sin(angle), height], axis=1)
    ways[:, :2] *= np.sqrt(1 - height**2)[:, None]
    eyes = _MIDDLE + _FAR * ways
    field = float(np.degrees(2 * np.arcsin(min(radius / _FAR, 0.9))))
    middle = (0.0, 0.0, float(_MIDDLE[2]))
    return {str(i): look_at((x, y, z), middle, field) for i, (x, y, z) in enumerate(eyes.tolist())}
