"""The window in a real browser: what is drawn is seen, and what is clicked is done."""

import io
import time

import numpy as np
import pytest
from PIL import Image

pytest.importorskip("viser", reason="viser is not installed: pip install 'imop[view]'")

from imop.viewing.browser import Browser, find_chromium
from imop.viewing.draw import MATCH, MEANT, PREDICTED
from imop.viewing.session import Session
from imop.viewing.window import Window
from tests.viewing.scenes import BLUE_AT, FakeDecider, FakeWorld

pytestmark = pytest.mark.skipif(find_chromium() is None, reason="no Chromium is installed")

LONG = 240.0
"""Seconds that a busy machine without a graphics card may take for anything."""
SIZE = (1100, 500)


def until(true, what):
    deadline = time.monotonic() + LONG
    while not true():
        assert time.monotonic() < deadline, what
        time.sleep(0.05)


class Page:
    """A session in a window in a browser."""

    def __init__(self, window, browser, session):
        self.window, self.browser, self.session = window, browser, session

    def press(self, words):
        """Click the button or the box with these words."""
        self.browser.wait(f"document.body.innerText.includes({words!r})", LONG)
        found = self.browser.evaluate(
            f"""(() => {{
                const all = [...document.querySelectorAll('button, label')]
                const there = all.find(e => e.innerText == {words!r})
                if (there) (document.getElementById(there.htmlFor) || there).click()
                return !!there
            }})()"""
        )
        assert found, f"there is no {words!r}"

    def colored(self, color):
        """How many pixels of the page have a colour, about."""
        pixels = np.asarray(Image.open(io.BytesIO(self.browser.screenshot())).convert("RGB"), dtype=float)
        return int((np.abs(pixels - 255 * np.array(color)).max(axis=2) < 30).sum())

    def pixel(self, p_world):
        """Where on the page a point is drawn."""
        camera = next(iter(self.window.server.get_clients().values())).camera
        w, x, y, z = camera.wxyz
        R = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
        p = R.T @ (np.asarray(p_world) - camera.position)
        canvas = "document.querySelector('canvas').getBoundingClientRect()"
        left, top, width, height = (
            self.browser.evaluate(f"{canvas}.{side}") for side in ("left", "top", "width", "height")
        )
        focal = height / 2 / np.tan(camera.fov / 2)
        return left + width / 2 + focal * p[0] / p[2], top + height / 2 + focal * p[1] / p[2]


@pytest.fixture(scope="module")
def page():
    session = Session(FakeDecider(), FakeWorld())
    with Window(session, port=0) as window, Browser(window.url, SIZE, LONG) as browser:
        browser.wait("!!document.querySelector('canvas') && document.body.innerText.includes('accept')")
        yield Page(window, browser, session)


def test_the_window_shows_what_was_decided_and_does_what_is_clicked(page):
    # Matches as lines, the predicted gripper, the slider and the probabilities.
    until(lambda: page.colored(MATCH) > 100, "no lines of matches are seen")
    assert page.colored(PREDICTED) > 20
    assert page.browser.evaluate("document.querySelectorAll('[role=slider]').length") == 1
    assert page.browser.evaluate("[...document.querySelectorAll('input')].some(e => e.value == '1: 80%')")
    assert page.browser.evaluate("document.body.innerText.includes('invariant')")

    # A layer is left out, and comes back.
    page.press("matches")
    until(lambda: page.colored(MATCH) < 20, "the lines of matches stay")
    page.press("matches")
    until(lambda: page.colored(MATCH) > 100, "the lines of matches do not come back")

    # The next candidate, which has no matched points.
    page.press("reject")
    until(lambda: page.session.present.chosen == 1, "nothing was rejected")
    until(lambda: page.colored(MATCH) < 20, "the next candidate is not shown")

    # What is clicked is meant.
    page.press("click on what is meant")
    until(lambda: page.window.pointing, "the box is not ticked")
    page.browser.click(*page.pixel(BLUE_AT[:3, 3] + [0, 0, 0.06]))
    until(lambda: page.session._decider.told[-1] is not None, "the click names nothing")
    meant = page.session._decider.told[-1].points
    assert np.linalg.norm(meant.mean(axis=0)[:2] - BLUE_AT[:2, 3]) < 0.02
    until(lambda: page.colored(MEANT) > 20, "what is meant is not marked")

    # What is accepted is performed, and the slider goes back to what it was.
    page.press("accept")
    until(lambda: len(page.session.looks) == 2 and page.colored(MEANT) < 5, "nothing was performed")
    assert page.session._decider.taken == [1]
    page.browser.evaluate("document.querySelector('[role=slider]').focus()")
    page.browser.key("ArrowLeft")
    until(lambda: page.colored(MEANT) > 20, "the slider does not go back")
