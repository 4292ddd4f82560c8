"""The browser window: shapes, a slider over steps, and a session's buttons. Nobody else knows viser."""

import logging
import threading
from collections.abc import Callable
from types import TracebackType
from typing import Any

import numpy as np

from imop.errors import ImopError
from imop.extras import extra
from imop.viewing.draw import ASIDE, LARGEST, SCALE, SMALLEST, draw
from imop.viewing.drawables import Drawable, Label, Path, Points
from imop.viewing.look import Look
from imop.viewing.session import Session
from imop.viewing.words import report

with extra("view"):
    import viser

LAYERS = {
    "matches": ("matches",),
    "other candidates": ("scene/others",),
    "path": ("demonstration/path", "demonstration/later", "scene/path"),
}
"""What can be left out: its name, and the beginnings of the names of shapes."""
# Where the window looks from, and at what, seen from the middle between both clouds, metres.
_EYE, _AT = np.array([1.3, 0.0, 1.0]), np.array([0.05, 0.0, 0.05])
# A window that is narrower than this, in heights of it and with the panel, looks from farther away.
_ASPECT = 2.35


class Window:
    """Shows a session to whoever opens its page; a context that closes it.

    Args:
        session: the episode.
        host: address to listen on; by default this machine alone can look.
        port: of the page.

    Raises:
        MissingExtra: without viser.
    """

    def __init__(self, session: Session, host: str = "127.0.0.1", port: int = 8080) -> None:
        self._session, self._busy, self._drawing = session, threading.Lock(), threading.RLock()
        # Browsers connect ahead and then ask nothing, which is no error to be told of.
        logging.getLogger("websockets.server").setLevel(logging.CRITICAL)
        self.server = viser.ViserServer(host=host, port=port, label="imop view", verbose=False)
        self.url = f"http://{host}:{self.server.get_port()}"
        self._drawn: dict[str, Any] = {}
        self._make_panel()
        self._show_all()
        self.server.initial_camera.fov = np.radians(50)
        self.server.on_client_connect(self._place_camera)

    def __enter__(self) -> "Window":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.server.stop()

    @property
    def pointing(self) -> bool:
        """Whether the next click says what is meant."""
        return bool(self._pointing.value)

    def _make_panel(self) -> None:
        gui = self.server.gui
        # Sharing would lead the page through somebody else's server.
        gui.configure_theme(show_logo=False, show_share_button=False)
        gui.main_panel.dock_right()
        self.server.scene.set_up_direction("+z")
        self._told = gui.add_markdown("")
        self._step = gui.add_slider("step", 1, 2, 1, 1)
        self._choice = gui.add_dropdown("candidate", ("-",))
        self._accept = gui.add_button("accept", hint="do what is shown", color="green")
        self._reject = gui.add_button("reject", hint="show the next candidate instead", color="orange")
        self._look = gui.add_button("look", hint="look and decide anew")
        stop = gui.add_button("stop", hint="bring to rest what moves", color="red")
        hint = "then click on the thing that is to be acted on"
        self._pointing = gui.add_checkbox("click on what is meant", False, hint=hint)
        self._layers = {name: gui.add_checkbox(name, True) for name in LAYERS}
        gui.add_html(_legend())
        self._step.on_update(self._chosen_step)
        self._choice.on_update(self._chosen_candidate)
        self._accept.on_click(lambda event: self._do(self._session.accept))
        self._reject.on_click(lambda event: self._do(self._session.reject))
        self._look.on_click(lambda event: self._do(self._session.look))
        stop.on_click(lambda event: self._session.stop())
        for layer in self._layers.values():
            layer.on_update(lambda event: self._show_layers())
        self.server.scene.on_click()(self._clicked)

    def _do(self, action: Callable[[], object]) -> None:
        """What a button means, unless another one is at it; then all is shown as it is now."""
        if not self._busy.acquire(blocking=False):
            return
        try:
            self._told.content = "_working ..._"
            try:
                action()
            except (ImopError, ConnectionError) as error:
                self._session.words = str(error)
            self._show_all()
        finally:
            self._busy.release()

    def _clicked(self, event: viser.SceneClickEvent) -> None:
        if self.pointing:
            _set(self._pointing, False)
            origin, direction = np.array(event.ray_origin), np.array(event.ray_direction)
            self._do(lambda: self._session.point(origin, direction))

    def _chosen_step(self, event: viser.GuiEvent[Any]) -> None:
        if event.client is not None:  # else it was set here
            looks = self._session.looks
            self._show(looks[min(int(self._step.value), len(looks)) - 1])

    def _chosen_candidate(self, event: viser.GuiEvent[Any]) -> None:
        if event.client is None:
            return
        number = self._choice.options.index(self._choice.value)
        if self._session.over or int(self._step.value) < len(self._session.looks):
            self._show(self._session.looks[int(self._step.value) - 1].choose(number))
        else:
            self._do(lambda: self._session.choose(number))

    def _show_all(self) -> None:
        """The present step, and how many there are."""
        count = len(self._session.looks)
        self._step.max, self._step.disabled = max(2, count), count == 1
        _set(self._step, count)
        self._show(self._session.present)

    def _show(self, look: Look) -> None:
        names = tuple(f"{k + 1}: {action.confidence:.0%}" for k, action in enumerate(look.choices)) or ("-",)
        present = look is self._session.present and not self._session.over
        with self._drawing, self.server.atomic():
            self._choice.options = names
            _set(self._choice, names[look.chosen])
            self._reject.disabled = not present or not look.choices
            self._accept.disabled = not present or look.way is None
            self._look.disabled = self._pointing.disabled = not present
            for handle in self._drawn.values():
                handle.remove()
            self._drawn = {shape.name: self._add(shape) for shape in draw(look)}
            self._show_layers()
            said = f"\n\n*{self._session.words}*" if self._session.words else ""
            self._told.content = report(look) + said

    def _show_layers(self) -> None:
        for layer, beginnings in LAYERS.items():
            for name, handle in self._drawn.items():
                if name.startswith(beginnings):
                    handle.visible = self._layers[layer].value

    def _place_camera(self, client: viser.ClientHandle) -> None:
        """So that both clouds are seen in a window of any shape."""
        points = self._session.present.scene.fused.points
        middle = (points.min(axis=0) + points.max(axis=0)) / 2 + ASIDE / 2
        client.camera.position = middle + _EYE * max(1.0, _ASPECT / client.camera.aspect)
        client.camera.look_at = middle + _AT

    def _add(self, shape: Drawable) -> Any:
        scene, name = self.server.scene, f"/{shape.name}"
        if isinstance(shape, Points):
            handle = scene.add_point_cloud(name, shape.points, shape.colors, point_size=shape.size)
            handle.point_shading = "flat"
            return handle
        if isinstance(shape, Label):
            return scene.add_label(
                name, shape.text, position=shape.p, font_screen_scale=shape.scale, anchor="bottom-center"
            )
        ends = np.stack([shape.points[:-1], shape.points[1:]], 1) if isinstance(shape, Path) else shape.ends
        color = np.array(shape.color)
        return scene.add_line_segments(name, ends, color, thickness=shape.width, thickness_units="screen")


def _set(handle: Any, value: object) -> None:
    """Type checkers take the values of viser's inputs for read-only."""
    handle.value = value


def _legend() -> str:
    """The scale of spreads, as HTML."""
    colors = ", ".join(f"rgb({', '.join(str(round(255 * c)) for c in color)})" for color in SCALE)
    ends = f"{1000 * SMALLEST:.0f} mm", f"{1000 * LARGEST:.0f} mm"
    return (
        '<div style="font-size: 12px; margin: 0.5em 1em">region: spread on other things'
        f'<div style="background: linear-gradient(to right, {colors}); height: 10px"></div>'
        f'<span>{ends[0]}, invariant</span><span style="float: right">{ends[1]}</span></div>'
    )
