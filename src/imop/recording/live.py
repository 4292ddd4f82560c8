"""Recording a real arm that somebody guides or drives, as long as nobody ends it."""

import queue
import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

from imop.calibration.collect import Rig
from imop.errors import InvalidInput
from imop.recording.recorder import DemonstrationRecorder

GAP = 1.0
"""Seconds after the last frame of an interrupted recording at which the next one is, if clocks began anew."""

Keys = Callable[[], str | None]
"""What was typed since the last call: a line, or None."""


def record_live(recorder: DemonstrationRecorder, rig: Rig, rate: float, keys: Keys) -> None:
    """Add frames until an empty line is typed; the lines o and c open and close the gripper.

    While the gripper is moved no frame is added: what is seen then is not needed, and the arm is not asked
    two things at once.

    Args:
        recorder: that was started.
        rig: arm and cameras.
        rate: frames per second, at most; slow cameras make it less.
        keys: what is typed.

    Raises:
        ConnectionError: if the arm or a camera does not answer; what was recorded is on disk.
        InvalidInput: for a rate that cannot be.
    """
    if not 1 <= rate <= 200:
        raise InvalidInput("rate", f"{rate:g}", "1 to 200 frames per second")
    later = None
    with ThreadPoolExecutor(len(rig.cameras)) as pool:
        due = time.monotonic()
        while (typed := keys()) != "":
            if typed in ("o", "c"):
                rig.robot.move_gripper(1.0 if typed == "o" else 0.0)
            waiting = {name: pool.submit(camera.capture) for name, camera in rig.cameras.items()}
            state = rig.robot.state()
            frames = {name: frame.result() for name, frame in waiting.items()}
            if later is None:
                last = recorder.last
                later = 0.0 if last is None or state.stamp > last else last + GAP - state.stamp
            if recorder.last is None or state.stamp + later > recorder.last:
                recorder.add(frames, replace(state, stamp=state.stamp + later))
            due = max(due + 1 / rate, time.monotonic() - 1 / rate)
            time.sleep(max(0.0, due - time.monotonic()))


def typed_lines() -> Keys:
    """Lines from the terminal, read beside the recording until an empty one."""
    lines: queue.Queue[str] = queue.Queue()

    def listen() -> None:
        for line in sys.stdin:
            lines.put(line.strip())
            if not line.strip():
                return
        lines.put("")  # nobody can type any more

    threading.Thread(target=listen, daemon=True).start()

    def typed() -> str | None:
        try:
            return lines.get_nowait()
        except queue.Empty:
            return None

    return typed
