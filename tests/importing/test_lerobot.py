"""The layout is that of LeRobot 0.6.1, which was compared with what the package itself writes."""

import io
import json
from fractions import Fraction

import numpy as np
import pytest
from PIL import Image

pytest.importorskip("pyarrow", reason="the extra import is not installed")
import pyarrow
from pyarrow import parquet

from imop.errors import CorruptData, InvalidInput
from imop.importing.lerobot import dequantized, read_dataset
from imop.importing.side import Side, SideCamera
from imop.recording.draft import Draft
from imop.recording.folder import RecordedCamera
from tests.recording import takes

NAMES = [*(f"joint_{i}.pos" for i in range(1, 8)), "gripper.pos"]
RGB, DEPTH = "observation.images.front", "observation.images.front_depth"
CODES = {"video.depth_min": 0.01, "video.depth_max": 10.0, "video.shift": 3.5, "video.use_log": True}
PLACE = {"chunk_index": 0, "file_index": 0}
SIDE = Side(
    {"front": SideCamera(known=RecordedCamera(takes.K, T_world_camera=takes.T_WORLD_FRONT))},
    joints=tuple(NAMES[:7]),
    fingers={"gripper.pos": (0.0, 100.0)},
    pose="observation.ee_pose",
)


def quantized(depth):
    low, high, shift = 0.01, 10.0, 3.5
    share = (np.log(depth + shift) - np.log(low + shift)) / (np.log(high + shift) - np.log(low + shift))
    return np.rint(4095 * share).clip(0, 4095).astype(np.uint16)


def stored(pixels, form):
    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, format=form)
    return {"bytes": buffer.getvalue(), "path": f"frame.{form.lower()}"}


def film(path, pictures, kind):
    """A lossless video; the package's own are AV1 and HEVC."""
    import av

    path.parent.mkdir(parents=True)
    with av.open(str(path), "w", format="matroska") as container:
        stream = container.add_stream("ffv1", rate=15)
        stream.height, stream.width = pictures[0].shape[:2]
        stream.pix_fmt = "gray12le" if kind == "gray12le" else "bgr0"
        stream.time_base = Fraction(1, 15)
        for number, picture in enumerate(pictures):
            frame = av.VideoFrame.from_ndarray(picture, format=kind)
            frame.pts = number
            container.mux(stream.encode(frame.reformat(format=stream.pix_fmt)))
        container.mux(stream.encode())


def write(root, videos=False, **changes):
    """Two episodes of the take, the second one without its first frame, as LeRobot lays them out."""
    rows, films, episodes = [], {RGB: [], DEPTH: []}, []
    from imop.geometry import se3

    for episode in range(2):
        states = list(enumerate(takes.moments()))[episode:]
        begin = len(rows)
        for index, (number, state) in enumerate(states):
            seen = takes.frames(number)["front"]
            row = {
                "observation.state": [*state.joint_positions, 100 * state.gripper_opening],
                "observation.ee_pose": se3.to_pose7(takes.T_WORLD_BASE @ state.T_base_gripper).tolist(),
                "timestamp": index / 15,
                "frame_index": index,
                "episode_index": episode,
                "index": len(rows),
                "task_index": 0,
            }
            if videos:
                films[RGB].append(seen.rgb)
                films[DEPTH].append(quantized(seen.depth))
            else:
                millimetres = np.round(1000 * seen.depth).astype(np.uint16)
                row |= {RGB: stored(seen.rgb, "PNG"), DEPTH: stored(millimetres, "TIFF")}
            rows.append(row)
        described = {"episode_index": episode, "tasks": ["lift it"], "length": len(states)}
        described |= {f"data/{key}": value for key, value in PLACE.items()}
        for key in films if videos else ():
            described |= {f"videos/{key}/{name}": value for name, value in PLACE.items()}
            described[f"videos/{key}/from_timestamp"] = begin / 15
        episodes.append(described)
    width, height = takes.SIZE
    kind = "video" if videos else "image"
    info = {
        "codebase_version": "v3.0",
        "fps": 15,
        "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
        "video_path": "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4",
        "features": {
            "observation.state": {"dtype": "float32", "shape": [8], "names": NAMES},
            "observation.ee_pose": {"dtype": "float32", "shape": [7], "names": None},
            RGB: {"dtype": kind, "shape": [height, width, 3], "info": {"is_depth_map": False}},
            DEPTH: {
                "dtype": kind,
                "shape": [height, width, 1],
                "info": {"is_depth_map": True, "depth_unit": "mm", **(CODES if videos else {})},
            },
        },
        **changes,
    }
    for place, table in (("meta/episodes", episodes), ("data", rows)):
        (root / place / "chunk-000").mkdir(parents=True)
        parquet.write_table(pyarrow.Table.from_pylist(table), root / place / "chunk-000" / "file-000.parquet")
    (root / "meta" / "info.json").write_text(json.dumps(info))
    for key, pictures in films.items() if videos else ():
        film(
            root / "videos" / key / "chunk-000" / "file-000.mp4",
            pictures,
            "rgb24" if key == RGB else "gray12le",
        )
    return root


@pytest.mark.parametrize(("videos", "tolerance"), [(False, 5.1e-4), (True, 2.5e-3)])
def test_a_dataset_becomes_demonstrations(tmp_path, videos, tolerance):
    if videos:
        pytest.importorskip("av", reason="the extra import is not installed")
    episodes = read_dataset(write(tmp_path / "lift", videos), SIDE)
    assert [len(episode.motion) for episode in episodes] == [57, 56]
    for episode, first in zip(episodes, (0, 1), strict=True):
        for number in (0, 31, len(episode.motion) - 1):
            state, seen = takes.moments()[first + number], takes.frames(first + number)["front"]
            found = episode.observation(number)
            np.testing.assert_allclose(
                found.T_world_gripper, takes.T_WORLD_BASE @ state.T_base_gripper, atol=1e-6
            )
            np.testing.assert_allclose(found.gripper_opening, state.gripper_opening, atol=1e-6)
            np.testing.assert_allclose(found.joint_positions, state.joint_positions, atol=1e-6)
            view = found.views["front"]
            np.testing.assert_array_equal(view.rgb, seen.rgb)
            np.testing.assert_array_equal(view.measured, seen.depth > 0)
            np.testing.assert_allclose(view.depth, seen.depth, atol=tolerance)
    assert episodes[0].instructions == ("lift it",) and episodes[0].task == "lerobot/lift"
    assert len(Draft.of(episodes[0]).demonstration()) == 2


def test_codes_are_turned_back_into_depth(rng):
    depth = rng.uniform(0.3, 5.0, (20, 30))
    np.testing.assert_allclose(dequantized(quantized(depth), CODES), depth, atol=2e-3)
    assert dequantized(np.zeros((2, 2), np.uint16), CODES).max() == 0


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"joints": ()}, "joints: missing"),
        ({"joints": ("elbow",)}, r"joints\[0\]"),
        ({"fingers": {}}, "gripper.fingers: missing"),
        ({"fingers": {"gripper.pos": (0.0, 1.0)}}, "gripper.fingers.gripper.pos"),
        ({"pose": ""}, "gripper.pose: missing"),
        ({"pose": "observation.pose"}, "observation.ee_pose"),
        ({"pose_format": "matrix"}, "7 numbers"),
        ({"cameras": {}}, "cameras.front.intrinsics: missing"),
        (
            {"cameras": {"front": SideCamera(known=RecordedCamera(takes.K))}},
            "cameras.front.T_world_camera: missing",
        ),
        ({"cameras": {"front": SideCamera(RGB, "depth")}}, "cameras.front.depth"),
        ({"cameras": {"side": SideCamera()}}, "cameras.side"),
    ],
)
def test_what_is_missing_is_named(tmp_path, change, field):
    from dataclasses import replace

    with pytest.raises(InvalidInput, match=field):
        read_dataset(write(tmp_path / "lift"), replace(SIDE, **change))


def test_other_versions_and_damage_are_said(tmp_path):
    with pytest.raises(CorruptData, match="v21"):
        read_dataset(write(tmp_path / "old", codebase_version="v2.1"), SIDE)
    root = write(tmp_path / "cut")
    (root / "data" / "chunk-000" / "file-000.parquet").write_bytes(b"PAR1")
    with pytest.raises(CorruptData, match="file-000"):
        read_dataset(root, SIDE)
    with pytest.raises(CorruptData, match=r"info\.json"):
        read_dataset(tmp_path, SIDE)
