import av
import numpy as np
import pytest

from imop.errors import InvalidInput
from imop.evaluation.video import save_video


def test_frames_come_back(tmp_path):
    frames = [np.full((48, 64, 3), level, np.uint8) for level in (0, 80, 160, 240)]
    save_video(frames, tmp_path / "a.mp4", frames_per_second=10)
    with av.open(str(tmp_path / "a.mp4")) as container:
        read = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
    assert len(read) == 4
    for wrote, got in zip(frames, read, strict=True):
        assert np.abs(wrote.astype(int) - got).mean() < 8


@pytest.mark.parametrize("frames", [[], [np.zeros((47, 64, 3), np.uint8)]])
def test_bad_frames_are_refused(tmp_path, frames):
    with pytest.raises(InvalidInput, match="frames"):
        save_video(frames, tmp_path / "a.mp4")
    assert not list(tmp_path.iterdir())
