# SPDX-License-Identifier: Apache-2.0
"""The controls of the viewer, beside the scene."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rfgs_core.view.colors import TITLES
from rfgs_core.view.pictures import ComparedPicture
from rfgs_core.view.selection import ColorMode, Selection, TruthDrawing

if TYPE_CHECKING:
    from viser import ViserServer

#: The far end of the power slider, which hides nothing [dB].
ALL_DB = 60.0

_NAMES = {title: mode for mode, title in TITLES.items()}
#: The true surface as the panel calls it.
_TRUTH_CALLED: dict[str, TruthDrawing] = {
    "thin outline": "outline",
    "hidden": "hidden",
    "shaded surface": "surface",
}
_MAX_BRIGHTNESS = 20.0


@dataclass(frozen=True)
class Offer:
    """What a run gives the user to choose from."""

    title: str
    """One line about the run, Markdown."""
    frames: Sequence[int]
    """Frames that are there, ascending."""
    modes: Sequence[ColorMode]
    """Modes there are values for."""
    max_opacity: float
    """Greatest opacity of a Gaussian."""
    cameras: Sequence[str]
    """Cameras to render through."""
    has_truth: bool
    """Whether the true surface is known."""
    has_skeletons: bool
    """Whether skeletons have been fitted."""
    has_room: bool
    """Whether there is a mesh of what stands still."""
    has_links: bool
    """Whether some devices measure each other."""
    has_layers: bool
    """Whether devices stand still, so that their rays and coverage can be drawn."""


class Panel:
    """Controls on a page; `selection` reads them all at once."""

    def __init__(
        self, server: ViserServer, offer: Offer, start: Selection, *, play: bool = False
    ) -> None:
        """Adds the controls: what everybody uses on top, the rest in folders that are closed.

        Args:
            server: The server of the page.
            offer: What there is to choose from.
            start: What is chosen first.
            play: Whether frames follow each other from the beginning.
        """
        self._frames = np.asarray(offer.frames)
        gui = server.gui
        gui.set_panel_label("RF-GS")
        gui.configure_theme(
            control_width="large", dark_mode=True, show_logo=False, show_share_button=False
        )
        gui.main_panel.dock_right()
        gui.add_markdown(offer.title)
        self._inputs: dict[str, Any] = {}
        self._add_time(gui, start, play)
        self._add_meaning(gui, offer, start)
        with gui.add_folder("More about Gaussians", expand_by_default=False):
            self._add_gaussians(gui, offer, start)
        with gui.add_folder("Scene", expand_by_default=False):
            self._add_scene(gui, offer, start)
        self._has_pictures = bool(offer.cameras)
        if offer.cameras:
            # A panel of its own: open on a desk, folded away below the others on a phone.
            below = gui.add_panel()
            with below.add_tab("Camera pictures"):
                self._add_pictures(gui, offer, start)
            below.dock_below(gui.main_panel)

    def selection(self) -> Selection:
        """What is chosen now."""
        value = {name: handle.value for name, handle in self._inputs.items()}
        nearest = int(self._frames[np.abs(self._frames - value["frame"]).argmin()])
        floor_db = value["below_peak_db"]
        return Selection(
            **{
                **value,
                "truth": _TRUTH_CALLED[value["truth"]],
                "frame": nearest,
                "mode": _NAMES[value["mode"]],
                "below_peak_db": floor_db if floor_db < ALL_DB else math.inf,
            }
        )

    def on_change(self, call: Callable[[], None]) -> None:
        """Calls `call` whenever a control changes, from threads of the server."""
        for handle in (*self._inputs.values(), self._play):
            handle.on_update(lambda _: call())

    def on_look(self, call: Callable[[Any], None]) -> None:
        """Calls `call` with the client that wants to look through the chosen camera."""
        if self._has_pictures:
            self._look.on_click(lambda event: call(event.client))

    @property
    def playing(self) -> bool:
        """Whether frames follow each other by themselves."""
        return bool(self._play.value)

    def next_frame(self) -> tuple[int, int]:
        """The frame shown and the one after it; the first follows the last."""
        frame = self.selection().frame
        index = int(np.flatnonzero(self._frames == frame)[0])
        return frame, int(self._frames[(index + 1) % len(self._frames)])

    def offer_frames(self, frames: Sequence[int]) -> None:
        """Offers other frames, when a training has finished some."""
        self._frames = np.asarray(frames)
        slider = self._inputs["frame"]
        slider.min, slider.max, slider.step = self._ends_and_step()
        self._play.disabled = len(frames) < 2

    def _ends_and_step(self) -> tuple[int, int, int]:
        step = int(np.gcd.reduce(np.diff(self._frames))) if len(self._frames) > 1 else 1
        return int(self._frames[0]), int(self._frames[-1]), step

    def set(self, field: str, value: Any) -> None:
        """Moves the control of a number or a tick of `Selection`."""
        self._inputs[field].value = value

    def tell(self, shown: str, legend: str) -> None:
        """Says what is shown and what its colours mean."""
        self._shown.content = shown
        self._legend.content = legend

    def tell_layers(self, legend: str) -> None:
        """Says what the layers of rays and coverage mean."""
        self._layers.content = legend

    def show_picture(self, shown: ComparedPicture) -> None:
        """Replaces the rendered picture and its caption."""
        self._picture.image = shown.picture
        self._caption.content = shown.caption

    def _add_time(self, gui: Any, start: Selection, play: bool) -> None:
        first, last, step = self._ends_and_step()
        self._inputs["frame"] = gui.add_slider("Frame", first, last, step, start.frame)
        self._play = gui.add_checkbox("Play", play and first < last, disabled=first == last)
        self._shown = gui.add_markdown("")

    def _add_meaning(self, gui: Any, offer: Offer, start: Selection) -> None:
        """What the colours say, and how the truth is told from what was fitted."""
        names = [TITLES[mode] for mode in offer.modes]
        self._inputs["mode"] = gui.add_dropdown(
            "Colour by", names, initial_value=TITLES[start.mode]
        )
        self._legend = gui.add_html("")
        self._inputs["truth"] = gui.add_dropdown(
            "Ground truth", tuple(_TRUTH_CALLED), initial_value=_called(start.truth),
            disabled=not offer.has_truth, hint="What really moved; never an output of the radio",
        )  # fmt: skip
        self._layers = gui.add_html("")

    def _add_gaussians(self, gui: Any, offer: Offer, start: Selection) -> None:
        top = math.ceil(100.0 * offer.max_opacity) / 100.0
        self._inputs |= {
            "drawn_as": gui.add_dropdown(
                "Draw as", ("points", "splats"), initial_value=start.drawn_as
            ),
            "min_opacity": gui.add_slider(
                "Opacity from", 0.0, top, top / 200.0, start.min_opacity,
                hint="Hides Gaussians with less opacity",
            ),
            "below_peak_db": gui.add_slider(
                "Power within [dB]", 0.0, ALL_DB, 1.0, min(start.below_peak_db, ALL_DB),
                hint="Hides what reflects this much less than the strongest; the end hides none",
            ),
            "brightness": gui.add_slider(
                "Brightness", 1.0, _MAX_BRIGHTNESS, 0.5, start.brightness,
                hint="Multiplies the opacity of splats; points are always opaque",
            ),
        }  # fmt: skip

    def _add_scene(self, gui: Any, offer: Offer, start: Selection) -> None:
        for name, label, there in (
            ("skeleton", "Skeletons", offer.has_skeletons),
            ("room", "Room", offer.has_room),
            ("radios", "Antennas", True),
            ("links", "Links", offer.has_links),
            ("rays", "Ray paths", offer.has_layers),
            ("coverage", "Coverage", offer.has_layers),
            ("cameras", "Cameras", bool(offer.cameras)),
        ):
            ticked = getattr(start, name) and there
            self._inputs[name] = gui.add_checkbox(label, ticked, disabled=not there)

    def _add_pictures(self, gui: Any, offer: Offer, start: Selection) -> None:
        self._inputs["camera"] = gui.add_dropdown(
            "Camera", tuple(offer.cameras), initial_value=start.camera
        )
        self._picture = gui.add_image(np.zeros((2, 4, 3), np.uint8), format="png")
        self._caption = gui.add_markdown("")
        self._look = gui.add_button("Look through this camera")


def _called(truth: TruthDrawing) -> str:
    return next(name for name, drawing in _TRUTH_CALLED.items() if drawing == truth)
