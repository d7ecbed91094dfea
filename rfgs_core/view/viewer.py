# SPDX-License-Identifier: Apache-2.0
"""The viewer of a run: keeps what the page shows in step with what its controls say."""

from __future__ import annotations

import logging
import threading
import time
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from tqdm import tqdm

from rfgs_core.errors import RfgsError
from rfgs_core.render.cameras import Camera
from rfgs_core.render.view import fitted_shader
from rfgs_core.run import Run
from rfgs_core.view.colors import colors_of, legend_html, scales_of
from rfgs_core.view.frame import ShownFrame, load_frame
from rfgs_core.view.panel import Offer, Panel
from rfgs_core.view.pictures import beside_true
from rfgs_core.view.radios import RadioShapes, radio_shapes
from rfgs_core.view.room import Room, room_of
from rfgs_core.view.selection import GAUSSIAN_FIELDS, ColorMode, Selection
from rfgs_core.view.stage import Stage

if TYPE_CHECKING:
    from viser import ClientHandle, ViserServer

_LOG = logging.getLogger(__name__)

#: Frames kept in memory, and frames that scales are made for.
_KEPT_FRAMES = 8
#: A progress bar is shown for what takes longer.
_PATIENCE_S = 2.0


def finished_frames(run: Run) -> list[int]:
    """Frames of a run that have been fitted; a run in training has some of them.

    Raises:
        RfgsError: There is none yet.
    """
    frames = [frame for frame in run.frames if run.ply_path(frame).is_file()]
    if not frames:
        raise RfgsError(f"{run.path}: no frame has been fitted yet; `rfgs train` goes on with it")
    return frames


class Viewer:
    """Shows a run on a server; everything is drawn by the thread that calls `update`."""

    def __init__(
        self,
        run: Run,
        server: ViserServer,
        frame: int | None = None,
        mode: ColorMode = "display",
    ) -> None:
        """Reads the run and draws it for the first time.

        Args:
            run: The run.
            server: Where to show it.
            frame: Frame to begin with; the first if not given.
            mode: Colours to begin with.

        Raises:
            RfgsError: The run has no such frame, or nothing to colour by `mode`.
        """
        self._run, self.server = run, server
        self.frames = finished_frames(run)
        self._frame_of = lru_cache(_KEPT_FRAMES)(self._load)
        begin = self.frames[0] if frame is None else frame
        if begin not in self.frames:
            raise RfgsError(
                f"{run.path}: no frame {begin}; it has {', '.join(map(str, self.frames))}"
            )
        samples = self._samples()
        self.scales = scales_of(samples)
        if mode not in self.scales:
            raise RfgsError(
                f"{run.path}: nothing to colour by {mode}; expected one of {', '.join(self.scales)}"
            )
        self._cameras = {row["name"]: Camera.from_dict(row) for row in run.sequence.cameras}
        room, radio = room_of(run.sequence), radio_shapes(run.sequence, run.config.radio)
        first = self._frame_of(begin)
        offer = Offer(
            title=self._title(),
            frames=self.frames,
            modes=list(self.scales),
            max_opacity=max(float(each.opacities.max(initial=0.01)) for each in samples),
            cameras=list(self._cameras),
            has_truth=first.truth is not None,
            has_room=room is not None,
            has_links=len(radio.links) > 0,
        )
        start = Selection(
            frame=begin,
            mode=mode,
            drawn_as="splats" if mode == "display" else "points",
            camera=next(iter(self._cameras), None),
        )
        self.stage = Stage(server, run.sequence.bounds_m)
        self.panel = Panel(server, offer, start)
        self._drawn: Selection | None = None
        self._changed = threading.Event()
        self._due_s = 0.0
        self._draw_fixed(room, radio)
        self.update()
        self.panel.on_change(self._changed.set)
        self.panel.on_look(self._look)

    def _samples(self) -> list[ShownFrame]:
        """Some frames, spread over the run."""
        chosen = np.linspace(0, len(self.frames) - 1, min(len(self.frames), _KEPT_FRAMES))
        bar = tqdm(chosen, desc="read", unit="frame", delay=_PATIENCE_S, leave=False)
        return [self._frame_of(self.frames[round(index)]) for index in bar]

    def follow(self) -> None:
        """Follows the controls until it is interrupted; a frame that cannot be drawn is told."""
        while True:
            try:
                self.step()
            except RfgsError as error:
                _LOG.warning("%s", error)

    def step(self, limit_s: float | None = None) -> None:
        """Waits until a control changes or the next frame is due, and draws that.

        Args:
            limit_s: Waits no longer than this; for ever if not given.
        """
        if self.panel.playing:
            limit_s = max(0.0, self._due_s - time.monotonic())
        self._changed.wait(limit_s)
        self._changed.clear()
        if self.panel.playing and time.monotonic() >= self._due_s:
            self._due_s = time.monotonic() + self._advance()
        self.update()

    def update(self) -> None:
        """Draws whatever has been chosen since the last time."""
        choice, before = self.panel.choice(), self._drawn
        self._drawn = choice
        frame = self._frame_of(choice.frame)
        with self.server.atomic():
            if choice.differs(before, *GAUSSIAN_FIELDS):
                self._show_gaussians(frame, choice)
            if choice.differs(before, "frame"):
                self.stage.draw_truth(frame.truth)
            self.stage.set_visible(choice)
        if choice.camera is not None and choice.differs(before, "frame", "camera"):
            self.panel.show_picture(beside_true(self._run, choice.camera, choice.frame))

    def _show_gaussians(self, frame: ShownFrame, choice: Selection) -> None:
        scale = self.scales[choice.mode]
        strongest_db = float(np.nanmax(frame.power_db, initial=-np.inf))
        rows = frame.rows(choice.min_opacity, strongest_db - choice.below_peak_db)
        self.stage.draw_gaussians(frame, rows, colors_of(frame, choice.mode, scale), choice)
        self.panel.tell(
            f"{self._run.sequence.time_s(choice.frame):.2f} s, "
            f"{rows.sum():,} of {len(frame):,} Gaussians",
            legend_html(choice.mode, scale),
        )

    def _advance(self) -> float:
        """Moves to the next frame; returns how long it lasts [s]."""
        now, following = self.panel.next_frame()
        self.panel.set("frame", following)
        sequence = self._run.sequence
        return max(sequence.time_s(following) - sequence.time_s(now), 1.0 / sequence.fps)

    def _look(self, client: ClientHandle | None) -> None:
        camera = self.panel.choice().camera
        if camera is not None and client is not None:
            self.stage.look_through(client, self._cameras[camera])

    def _load(self, frame: int) -> ShownFrame:
        return load_frame(self._run, frame, fitted_shader(self._run))

    def _draw_fixed(self, room: Room | None, radio: RadioShapes) -> None:
        if room is not None:
            self.stage.draw_room(room)
        self.stage.draw_radios(radio)
        self.stage.draw_cameras(list(self._cameras.values()))

    def _title(self) -> str:
        sequence, name = self._run.sequence, self._run.config.radio
        radio = sequence.radio_spec(name)
        return (
            f"**{sequence.name}**, {name} {radio.freq_min_hz / 1e9:g}–{radio.freq_max_hz / 1e9:g} "
            f"GHz, {len(self.frames)} frames"
        )
