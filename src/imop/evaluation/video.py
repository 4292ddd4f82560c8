"""Frames to an MP4 file."""

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

from imop.errors import InvalidInput
from imop.extras import extra
from imop.files import replaced
from imop.types import ByteArray

with extra("viz"):
    import av


def save_video(frames: Sequence[ByteArray], path: Path, frames_per_second: int = 20) -> None:
    """Write `frames`, each (H, W, 3) uint8 with even H and W, as H.264.

    Raises:
        InvalidInput: if there is no frame, or a side is odd.
    """
    if not frames:
        raise InvalidInput("frames", "empty", "at least one (H, W, 3) uint8 image")
    height, width = frames[0].shape[:2]
    if height % 2 or width % 2:
        raise InvalidInput("frames", f"{width} x {height} pixels", "even width and height (H.264)")
    with replaced(path) as temporary, av.open(str(temporary), "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=Fraction(frames_per_second))
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        for image in frames:
            for packet in stream.encode(av.VideoFrame.from_ndarray(image, format="rgb24")):
                container.mux(packet)
        for packet in stream.encode():
            container.mux(packet)
