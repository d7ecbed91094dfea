# SPDX-License-Identifier: Apache-2.0
"""The moving Gaussians of a stream on a page of the viewer, coloured by what they reflect."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from rfgs_core.fit.frame import FrameState
from rfgs_core.live.feed import power_db
from rfgs_core.live.setting import Setting
from rfgs_core.view.colors import Scale, colors_of, legend_html
from rfgs_core.view.frame import ShownFrame
from rfgs_core.view.radios import shapes_of
from rfgs_core.view.selection import Selection
from rfgs_core.view.stage import Stage

if TYPE_CHECKING:
    from viser import ViserServer

#: Pages are drawn at most so often [1/s]; a browser shows no more of a room.
_PER_S = 15.0
#: Powers from the strongest down that have colours of their own [dB].
_SPAN_DB = 25.0


class Page:
    """A page that shows the newest Gaussians."""

    def __init__(self, server: ViserServer, setting: Setting) -> None:
        """Draws what stands still.

        Args:
            server: Where to show it.
            setting: Radios and bounds.
        """
        self._server = server
        self._stage = Stage(server, setting.bounds_m)
        self._stage.draw_radios(shapes_of(setting.devices, setting.layout))
        self._stage.set_visible(Selection(frame=0, mode="power"))
        centre = setting.freq_hz.mean() / 1e9
        server.gui.add_markdown(f"**{setting.name}**, live, {centre:.3f} GHz")
        self._text = server.gui.add_markdown("waiting for somebody who moves")
        self._legend = server.gui.add_html("")
        self._scale: Scale | None = None
        self._due_s = 0.0

    def show(self, state: FrameState) -> None:
        """Draws an update, unless the last one was drawn just before."""
        now_s = time.monotonic()
        if now_s < self._due_s:
            return
        self._due_s = now_s + 1.0 / _PER_S
        frame = _shown(state)
        if self._scale is None:
            top_db = float(np.percentile(frame.power_db, 99.0))
            self._scale = Scale(top_db - _SPAN_DB, top_db)
            self._legend.content = legend_html("power", self._scale)
        choice = Selection(frame=0, mode="power")
        with self._server.atomic():
            rows = np.ones(len(frame), bool)
            colors = colors_of(frame, "power", self._scale)
            self._stage.draw_gaussians(frame, rows, colors, choice)
        places = "; ".join(f"{x:.2f}, {y:.2f} m" for x, y in state.tracks.axes_xy)
        self._text.content = f"{len(frame):,} Gaussians, at {places}"


def _shown(state: FrameState) -> ShownFrame:
    """An update as the viewer draws frames."""
    gaussians, count = state.gaussians, len(state.track_id)
    unknown = np.full(count, np.nan, np.float32)
    return ShownFrame(
        frame=0,
        means=gaussians.means.numpy(),
        covariances=gaussians.covariances.numpy(),
        opacities=gaussians.opacities.numpy(),
        rgb=np.full((count, 3), 0.5, np.float32),
        power_db=power_db(state),
        phase_rad=np.angle(state.gamma.detach().numpy()).astype(np.float32),
        error_m=unknown,
        truth=None,
    )
