"""A recording that needs no simulator: a hand that reaches, closes, lifts and opens, seen by tiny cameras."""

import numpy as np

from imop.cameras.interfaces import Frame
from imop.geometry import se3
from imop.recording.recorder import DemonstrationRecorder
from imop.robots.interfaces import RobotState
from imop.setup.setup import CameraSetup, RobotSetup, Setup, WorkspaceSetup

RATE = 15.0
SIZE = (12, 8)
K = np.array([[10.0, 0, 6], [0, 10, 4], [0, 0, 1]])
T_WORLD_BASE = se3.make(se3.euler(z=0.3), (0.1, 0.0, 0.75))
T_WORLD_FRONT = se3.make(se3.euler(x=np.pi), (0.4, 0.0, 1.6))
T_GRIPPER_WRIST = se3.make(se3.euler(y=0.2), (-0.05, 0.0, -0.1))
DOWN = se3.euler(x=np.pi)


def cell() -> Setup:
    """One camera beside the arm, one on the hand, which demonstrations call wrist."""
    return Setup(
        RobotSetup("panda", np.zeros(7) + 0.1, T_WORLD_BASE),
        WorkspaceSetup((-1, -1, 0.7), (1, 1, 1.7), 0.75),
        {
            "front": CameraSetup(K, SIZE, T_WORLD_FRONT),
            "d405": CameraSetup(K, SIZE, None, T_GRIPPER_WRIST, "wrist"),
        },
    )


def moments(rate: float = RATE) -> list[RobotState]:
    """Stand 0.4 s, reach 1 s, close 0.3 s, lift 1 s, stand 0.4 s, open 0.3 s, stand 0.4 s."""
    t = np.arange(round(3.8 * rate)) / rate
    height = np.interp(t, [0, 0.4, 1.4, 1.8, 2.8, 4], [0.6, 0.6, 0.1, 0.1, 0.4, 0.4])
    opening = np.interp(t, [0, 1.4, 1.7, 3.1, 3.4, 4], [1, 1, 0.6, 0.6, 1, 1])
    return [
        RobotState(se3.make(DOWN, (0.3, 0.0, h)), float(o), np.full(7, h), 100.0 + float(s))
        for s, h, o in zip(t, height, opening, strict=True)
    ]


def frames(number: int) -> dict[str, Frame]:
    """What the cameras see in a frame: other pixels in each."""
    rng = np.random.default_rng(number)
    width, height = SIZE
    return {
        name: Frame(
            rng.integers(0, 256, (height, width, 3), dtype=np.uint8),
            np.where(rng.random((height, width)) < 0.1, 0, rng.uniform(0.3, 3, (height, width))),
            K,
            100.0 + number / RATE,
        )
        for name in ("front", "d405")
    }


def record(folder, first: int = 0, last: int | None = None) -> None:
    """Add some of the frames, and end as an interruption would."""
    with DemonstrationRecorder.start(folder, cell(), task="test/lift", instructions=("lift it",)) as recorder:
        for number, state in list(enumerate(moments()))[first:last]:
            recorder.add(frames(number), state)
