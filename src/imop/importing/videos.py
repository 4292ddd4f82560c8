"""Single frames of a video."""

from pathlib import Path
from typing import Any

from imop.errors import CorruptData
from imop.extras import extra

_REMEDY = "restore it, or download the dataset again"


def video_frame(path: Path, seconds: float, pixels: str) -> Any:
    """The frame that is shown at a time, (H, W) or (H, W, 3).

    Args:
        path: of the video.
        seconds: since its beginning.
        pixels: format to convert it to, by FFmpeg's name.

    Raises:
        CorruptData: if the file is missing, damaged, or ends before.
        MissingExtra: without PyAV.
    """
    with extra("import"):
        import av
    if not path.is_file():
        raise CorruptData(path, "the file is missing", _REMEDY)
    try:
        with av.open(str(path)) as container:
            stream = container.streams.video[0]
            period = 1.0 / float(stream.average_rate or 30)
            base = float(stream.time_base or 1)
            # The nearest frame before from which one can decode, then forward.
            container.seek(max(round(seconds / base) - 1, 0), backward=True, stream=stream)
            for frame in container.decode(stream):
                if frame.pts is not None and frame.pts * base > seconds - period / 2:
                    return frame.to_ndarray(format=pixels)
    except av.FFmpegError as error:
        raise CorruptData(path, f"cannot be decoded ({error})", _REMEDY) from error
    raise CorruptData(path, f"ends before {seconds:.3f} s", _REMEDY)
