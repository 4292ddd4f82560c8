"""A headless Chromium, driven over its debugging protocol: pictures, clicks, and what a page shows."""

import base64
import itertools
import json
import os
import shutil
import subprocess
import tempfile
import time
import urllib.request
from pathlib import Path
from types import TracebackType
from typing import Any

from imop.errors import InvalidInput
from imop.extras import extra

with extra("view"):
    from websockets.sync.client import connect

PROGRAMS = ("chromium", "chromium-browser", "google-chrome", "chrome")
# It draws without a graphics card, asks no server of its maker, and leaves nothing behind.
_OPTIONS = (
    "--headless=new",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--hide-scrollbars",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-quic",
    "--disable-dev-shm-usage",
    "--remote-debugging-port=0",
)

_KEYS = {"ArrowLeft": 37, "ArrowUp": 38, "ArrowRight": 39, "ArrowDown": 40}


def find_chromium() -> str | None:
    """Path of the browser; None if none is installed."""
    return next((path for path in map(shutil.which, PROGRAMS) if path), None)


class Browser:
    """One page in a browser of its own; a context that ends the browser.

    Args:
        url: of the page.
        size: width and height of the page, pixels.
        seconds: how long the browser may take to start, and to answer.

    Raises:
        InvalidInput: if no Chromium is installed, or it does not start.
    """

    def __init__(self, url: str, size: tuple[int, int] = (1400, 800), seconds: float = 60.0) -> None:
        program = find_chromium()
        if program is None:
            raise InvalidInput("browser", "no Chromium was found", f"{' or '.join(PROGRAMS)}, installed")
        self._seconds, self._numbers = seconds, itertools.count(1)
        self._folder = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        own = [f"--user-data-dir={self._folder.name}", f"--window-size={size[0]},{size[1]}"]
        if os.geteuid() == 0:
            own.append("--no-sandbox")  # which root cannot have
        self._process = subprocess.Popen(
            [program, *_OPTIONS, *own, url], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        try:
            self._socket = connect(self._page(), max_size=None)
            # The window's own size counts what a headless browser does not have around its page.
            page = {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": False}
            self._ask("Emulation.setDeviceMetricsOverride", **page)
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> "Browser":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the browser."""
        self._process.terminate()
        try:
            self._process.wait(timeout=10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._folder.cleanup()

    def evaluate(self, expression: str) -> Any:
        """The value of a JavaScript expression in the page.

        Raises:
            InvalidInput: if it fails.
        """
        answer = self._ask("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in answer:
            raise InvalidInput("expression", str(answer["exceptionDetails"]), "JavaScript that can be run")
        return answer["result"].get("value")

    def wait(self, condition: str, seconds: float | None = None) -> Any:
        """The value of a JavaScript expression as soon as it is true.

        Raises:
            InvalidInput: if it does not become true in time.
        """
        deadline = time.monotonic() + (seconds or self._seconds)
        while not (value := self.evaluate(condition)):
            if time.monotonic() > deadline:
                raise InvalidInput("condition", f"{condition} did not become true", "what the page will show")
            time.sleep(0.1)
        return value

    def click(self, x: float, y: float) -> None:
        """Press and release the left button of the mouse at a place of the page, pixels."""
        place = {"x": x, "y": y}
        self._ask("Input.dispatchMouseEvent", type="mouseMoved", **place)
        for kind in ("mousePressed", "mouseReleased"):
            self._ask("Input.dispatchMouseEvent", type=kind, button="left", clickCount=1, **place)

    def key(self, name: str) -> None:
        """Press and release a key, by the name that browsers give it, such as ArrowLeft."""
        code = _KEYS.get(name, 0)
        for kind in ("rawKeyDown", "keyUp"):
            self._ask("Input.dispatchKeyEvent", type=kind, key=name, code=name, windowsVirtualKeyCode=code)

    def screenshot(self) -> bytes:
        """The page as it looks now, a PNG."""
        return base64.b64decode(self._ask("Page.captureScreenshot", format="png")["data"])

    def _ask(self, method: str, **values: object) -> dict[str, Any]:
        number = next(self._numbers)
        self._socket.send(json.dumps({"id": number, "method": method, "params": values}))
        while True:
            answer = json.loads(self._socket.recv(timeout=self._seconds))
            if answer.get("id") == number:
                if "error" in answer:
                    raise InvalidInput("browser", f"{method}: {answer['error']}", "what it understands")
                found: dict[str, Any] = answer["result"]
                return found

    def _page(self) -> str:
        """Address of the page's debugger."""
        told = Path(self._folder.name) / "DevToolsActivePort"
        deadline = time.monotonic() + self._seconds
        while time.monotonic() < deadline and self._process.poll() is None:
            if told.is_file() and (lines := told.read_text().split()):
                with urllib.request.urlopen(f"http://127.0.0.1:{lines[0]}/json/list") as answer:
                    pages = [page for page in json.load(answer) if page["type"] == "page"]
                if pages:
                    return str(pages[0]["webSocketDebuggerUrl"])
            time.sleep(0.1)
        raise InvalidInput("browser", "Chromium did not start", "a Chromium that starts with --headless")


# What software rendering makes the page say, which belongs in no picture.
_NO_NOTICES = "document.querySelectorAll('.mantine-Notification-root').forEach(it => it.remove())"


def picture(url: str, size: tuple[int, int], seconds: float = 300.0) -> bytes:
    """A PNG of the page of a `Window`, as soon as it no longer changes.

    Args:
        url: of the page.
        size: width and height, pixels.
        seconds: how long it may take.

    Raises:
        InvalidInput: if there is no Chromium, or the page does not come to rest.
    """
    with Browser(url, size) as browser:
        deadline, before = time.monotonic() + seconds, b""
        browser.wait("!!document.querySelector('canvas')", seconds)
        browser.wait("document.body.innerText.includes('candidate')", seconds)
        while time.monotonic() < deadline:
            time.sleep(1.0)
            browser.evaluate(_NO_NOTICES)
            now = browser.screenshot()
            if now == before:
                return now
            before = now
    raise InvalidInput("picture", f"still changes after {seconds:.0f} s", "a page that comes to rest")
