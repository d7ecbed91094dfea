# SPDX-License-Identifier: Apache-2.0
"""The viewer of a run: keeps what the page shows in step with what its controls say."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Collection
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rfgs_core.errors import RfgsError
from rfgs_core.frames import listed
from rfgs_core.render.cameras import Camera
from rfgs_core.run import Run
from rfgs_core.view.colors import PREFERRED, colors_of, legend_html, scales_of
from rfgs_core.view.coverage import Coverage, coverage_of
from rfgs_core.view.frame import ShownFrame
from rfgs_core.view.frames import Frames, where_people_are
from rfgs_core.view.layer_colors import layers_html
from rfgs_core.view.panel import Offer, Panel
from rfgs_core.view.pictures import rendered_and_true
from rfgs_core.view.radios import RadioShapes, radio_shapes
from rfgs_core.view.rays import Rays, follows_frames, rays_of
from rfgs_core.view.room import Room, room_of
from rfgs_core.view.selection import GAUSSIAN_FIELDS, ColorMode, Layer, Selection
from rfgs_core.view.stage import Stage

if TYPE_CHECKING:
    from viser import ClientHandle, ViserServer

_LOG = logging.getLogger(__name__)

#: How often a run in training is asked for more frames [s].
_LOOK_S = 2.0


class Viewer:
    """Shows a run on a server; everything is drawn by the thread that calls `update`."""

    def __init__(
        self,
        run: Run,
        server: ViserServer,
        frame: int | None = None,
        mode: ColorMode | None = None,
        show: Collection[Layer] = (),
        *,
        play: bool = False,
    ) -> None:
        """Reads the run and draws it for the first time.

        Args:
            run: The run.
            server: Where to show it.
            frame: Frame to begin with; the first if not given.
            mode: Colours to begin with; if not given, how far each Gaussian is from the truth, or
                else what it reflects.
            show: What is shown beside Gaussians, truth, room and antennas.
            play: Whether frames follow each other from the beginning.

        Raises:
            RfgsError: The run has no such frame, or nothing to colour by `mode`.
        """
        self._run, self.server = run, server
        self.frames = Frames(run)
        numbers = self.frames.numbers
        begin = numbers[0] if frame is None else frame
        if begin not in numbers:
            raise RfgsError(f"{run.path}: no frame {begin}; it has {listed(numbers)}")
        samples = self.frames.samples()
        self.scales = scales_of(samples)
        mode = mode or next(known for known in PREFERRED if known in self.scales)
        if mode not in self.scales:
            raise RfgsError(
                f"{run.path}: nothing to colour by {mode}; expected one of {', '.join(self.scales)}"
            )
        self._cameras = {row["name"]: Camera.from_dict(row) for row in run.sequence.cameras}
        room, radio = room_of(run.sequence), radio_shapes(run.sequence, run.config.radio)
        first = self.frames.read(begin)
        offer = Offer(
            title=self._title(),
            frames=numbers,
            modes=list(self.scales),
            max_opacity=max(float(each.opacities.max(initial=0.01)) for each in samples),
            cameras=list(self._cameras),
            has_truth=first.truth is not None,
            has_skeletons=self.frames.has_skeletons,
            has_room=room is not None,
            has_links=len(radio.links) > 0,
            has_layers=not run.sequence.radio_spec(run.config.radio).antennas_move,
        )
        start = Selection(frame=begin, mode=mode, camera=next(iter(self._cameras), None))
        start = replace(start, **dict.fromkeys(show, True))
        self.stage = Stage(server, where_people_are(samples, run.sequence.bounds_m))
        self.panel = Panel(server, offer, start, play=play)
        self._drawn: Selection | None = None
        self._rays: Rays | None = None
        self._coverage: Coverage | None = None
        self._changed = threading.Event()
        self._due_s = 0.0
        self._draw_fixed(room, radio)
        self.update()
        self.panel.on_change(self._changed.set)
        self.panel.on_look(self._look)

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
        elif self.frames.growing:
            limit_s = _LOOK_S if limit_s is None else min(limit_s, _LOOK_S)
        self._changed.wait(limit_s)
        self._changed.clear()
        if self.frames.growing and self.frames.grow():
            self.panel.offer_frames(self.frames.numbers)
        if self.panel.playing and time.monotonic() >= self._due_s:
            self._due_s = time.monotonic() + self._advance()
        self.update()

    def time_s(self, frame: int) -> float:
        """When a frame is [s]."""
        return self._run.sequence.time_s(frame)

    def update(self) -> None:
        """Draws whatever has been chosen since the last time."""
        selection, before = self.panel.selection(), self._drawn
        self._drawn = selection
        frame = self.frames.read(selection.frame)
        with self.server.atomic():
            if selection.differs(before, *GAUSSIAN_FIELDS):
                self._show_gaussians(frame, selection)
            if selection.differs(before, "frame"):
                self.stage.draw_truth(frame.truth)
                self.stage.draw_skeletons(self.frames.bones(selection.frame))
            self._show_layers(selection, before)
            self.stage.set_visible(selection)
        if selection.camera is not None and selection.differs(before, "frame", "camera"):
            self.panel.show_picture(rendered_and_true(self._run, selection.camera, selection.frame))

    def _show_gaussians(self, frame: ShownFrame, selection: Selection) -> None:
        scale = self.scales[selection.mode]
        strongest_db = float(np.nanmax(frame.power_db, initial=-np.inf))
        rows = frame.rows(selection.min_opacity, strongest_db - selection.below_peak_db)
        self.stage.draw_gaussians(frame, rows, colors_of(frame, selection.mode, scale), selection)
        self.panel.tell(
            f"{self.time_s(selection.frame):.2f} s, {rows.sum():,} of {len(frame):,} Gaussians",
            legend_html(selection.mode, scale),
        )

    def _show_layers(self, selection: Selection, before: Selection | None) -> None:
        """Draws rays and coverage when they are first asked for, and says what they mean."""
        sequence, radio = self._run.sequence, self._run.config.radio
        new = selection.differs(before, "frame") and follows_frames(sequence, radio)
        if selection.rays and (new or self._rays is None):
            self._rays = rays_of(sequence, radio, selection.frame)
            if self._rays is not None:
                self.stage.draw_rays(self._rays)
        if selection.coverage and self._coverage is None:
            self._coverage = coverage_of(sequence, radio)
            if self._coverage is not None:
                self.stage.draw_coverage(self._coverage)
        if selection.differs(before, "rays", "coverage"):
            rays = self._rays if selection.rays else None
            coverage = self._coverage if selection.coverage else None
            self.panel.tell_layers(layers_html(rays, coverage))

    def _advance(self) -> float:
        """Moves to the next frame; returns how long it lasts [s]."""
        now, following = self.panel.next_frame()
        self.panel.set("frame", following)
        return max(self.time_s(following) - self.time_s(now), 1.0 / self._run.sequence.fps)

    def _look(self, client: ClientHandle | None) -> None:
        camera = self.panel.selection().camera
        if camera is not None and client is not None:
            self.stage.look_through(client, self._cameras[camera])

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
            f"GHz, {len(self.frames.numbers)} frames"
        )
