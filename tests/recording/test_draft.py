import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from imop.demos.store import DemonstrationStore
from imop.errors import InvalidInput
from imop.recording.draft import Draft
from imop.recording.edits import edited
from imop.recording.keyframes_file import load_draft
from imop.recording.motion import Motion
from imop.recording.saving import save_all
from imop.recording.show import keyframes_table, save_picture
from tests.recording import takes


class Still:
    """A source of 50 frames at 10 Hz without images."""

    name, task, instructions = "still", "", ()
    motion = Motion(np.arange(50) / 10, np.tile(np.eye(4), (50, 1, 1)), np.ones(50))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("takes") / "take"
    takes.record(place)
    return place


def test_steps_of_a_known_take(folder):
    draft = load_draft(folder)
    # Reached and closed; lifted and opened, where it ends.
    assert len(draft.frames) == 3
    times = draft.source.motion.times[list(draft.frames)] - 100.0
    assert 1.5 <= times[1] <= 1.9 and times[2] > 3.4
    assert draft.gripper_open.tolist() == [True, False, True]


def test_a_demonstration_is_what_was_reached_and_seen(folder):
    draft = load_draft(folder)
    made = draft.demonstration()
    assert made.task == "test/lift" and made.instructions == ("lift it",)
    for step, keyframe in enumerate(made.keyframes):
        assert keyframe.observation.time_step == step
        reached = made.after(step).T_world_gripper
        np.testing.assert_allclose(keyframe.action.T_world_gripper, reached, atol=1e-9)
        assert keyframe.action.gripper_open == draft.gripper_open[step + 1]
    assert [k.action.allow_collisions for k in made.keyframes] == [True, True]


def test_long_ways_with_still_fingers_avoid_things():
    n = 30
    T = np.tile(np.eye(4), (n, 1, 1))
    T[10:, 0, 3], T[20:, 0, 3] = 0.4, 0.5

    class Long(Still):
        motion = Motion(np.arange(n) / 10, T, np.ones(n))

    assert Draft(Long(), (0, 12, 25)).may_touch.tolist() == [False, True]

    class Fist(Still):
        motion = Motion(np.arange(n) / 10, T, np.zeros(n))

    assert Draft(Fist(), (0, 12, 25)).may_touch.tolist() == [True, True]


@given(st.sets(st.integers(0, 49), min_size=2), st.integers(0, 49))
def test_what_was_added_can_be_removed(frames, frame):
    draft = Draft(Still(), tuple(sorted(frames)))
    if frame in frames:
        with pytest.raises(InvalidInput, match="there is one"):
            draft.added(frame)
        return
    more = draft.added(frame)
    number = more.frames.index(frame)
    if number:
        assert more.removed(number).frames == draft.frames


@given(st.sets(st.integers(0, 49), min_size=2), st.integers(0, 48), st.integers(-60, 60))
def test_a_keyframe_stays_between_its_neighbours(frames, number, way):
    draft = Draft(Still(), tuple(sorted(frames)))
    number %= len(draft.frames)
    low = draft.frames[number - 1] if number else -1
    high = draft.frames[number + 1] if number + 1 < len(draft.frames) else 50
    target = draft.frames[number] + way
    sign = "+" if way >= 0 else "-"
    if low < target < high:
        assert edited(draft, [f"{number}:{sign}{abs(way)}"], [], []).frames[number] == target
    else:
        with pytest.raises(InvalidInput, match="keyframes"):
            edited(draft, [f"{number}:{sign}{abs(way)}"], [], [])


def test_all_edits_speak_of_the_table_that_was_shown():
    draft = Draft(Still(), (0, 10, 20, 30))
    assert edited(draft, ["1:12", "3:-0.5s"], ["2.2s", "40"], [2]).frames == (0, 12, 22, 25, 40)
    for wrong in (["9:3"], ["1"], ["1:x"], ["1:+"]):
        with pytest.raises(InvalidInput, match="move"):
            edited(draft, wrong, [], [])
    with pytest.raises(InvalidInput, match="add"):
        edited(draft, [], ["-3"], [])
    with pytest.raises(InvalidInput, match="beginning"):
        edited(draft, [], [], [0])


def test_saving_twice_stores_once(folder, tmp_path):
    draft = load_draft(folder)
    assert (
        save_all([draft], tmp_path / "s.zarr").stored,
        len(DemonstrationStore.open(tmp_path / "s.zarr")),
    ) == (1, 1)
    again = save_all([draft, draft.moved(1, draft.frames[1] + 1)], tmp_path / "s.zarr")
    assert (again.stored, again.there_already) == (1, 1)
    assert len(DemonstrationStore.open(tmp_path / "s.zarr")) == 2


def test_keyframes_can_be_looked_at(folder, tmp_path):
    draft = load_draft(folder)
    assert keyframes_table(draft).row_count == len(draft.frames)
    save_picture(draft, tmp_path / "sheet.png")
    from PIL import Image

    with Image.open(tmp_path / "sheet.png") as image:
        assert image.width == 240 * len(draft.frames)
    with pytest.raises(InvalidInput, match="picture"):
        save_picture(draft, tmp_path / "sheet.gif")


def test_motions_that_cannot_be_are_named():
    T, n = np.tile(np.eye(4), (3, 1, 1)), np.ones(3)
    for times, poses, opening, word in (
        ([0, 1, 1], T, n, "frame 2"),
        ([0, 1, 2], 2 * T, n, "T_world_gripper"),
        ([0, 1, 2], T, 0.08 + n, "gripper_opening"),
    ):
        with pytest.raises(InvalidInput, match=word):
            Motion(np.array(times, float), poses, opening)
    with pytest.raises(InvalidInput, match="two"):
        Motion(np.zeros(1), T[:1], n[:1])
