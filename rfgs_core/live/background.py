# SPDX-License-Identifier: Apache-2.0
"""What stands still, learned while packets come, and what a window changes of it."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Complex64, Float64

from rfgs_core.live.setting import Setting
from rfgs_core.live.windows import Window
from rfgs_core.measure.kinds import KINDS, Visible
from rfgs_core.measure.observations import Observations


class Background:
    """The channel of the empty room: recorded, or the running mean over what was heard.

    The mean forgets exponentially with `memory_s`; until so much was heard it is the plain mean.
    Somebody who stands still for that long becomes part of it.
    """

    def __init__(self, setting: Setting, learn_s: float, memory_s: float) -> None:
        """Begins with the setting's empty room, if it has one.

        Args:
            setting: The radios.
            learn_s: So much of every link has to be heard before changes are told [s].
            memory_s: Time constant of the mean [s].
        """
        self._setting, self._learn_s, self._memory_s = setting, learn_s, memory_s
        shape = setting.layout.measured.shape
        self._heard_s: Float64[np.ndarray, "tx rx"] = np.zeros(shape)
        #: Mean channel, or mean power.
        self._mean = np.zeros((*shape, len(setting.freq_hz)), np.complex128)
        self._before_s: float | None = None
        if setting.static is not None:
            self._mean[:] = self._averaged(setting.static)
            self._heard_s[:] = np.inf

    def learn(self, window: Window) -> None:
        """Lets a window into the mean; not where the empty room was recorded."""
        elapsed_s = window.end_s - (self._before_s or window.end_s)
        self._before_s = window.end_s
        if self._setting.static is not None or elapsed_s <= 0:
            return
        self._heard_s[window.links] += elapsed_s
        share = elapsed_s / np.clip(self._heard_s, elapsed_s, self._memory_s)
        share = np.where(window.links, share, 0.0)[..., None]
        self._mean += share * (self._averaged(window.mean) - self._mean)

    @property
    def known(self) -> Bool[np.ndarray, "tx rx"]:
        """Links whose background was heard for long enough."""
        return self._heard_s >= self._learn_s

    def change(self, window: Window) -> Observations:
        """What a window changes, as training sees a frame; unknown links are not visible."""
        setting = self._setting
        links = window.links & self.known
        seen = Visible(links, setting.subcarriers, setting.layout, setting.freq_hz)
        empty = self._mean if setting.reported == "complex" else np.sqrt(self._mean.real)
        kind = KINDS[setting.reported]
        change = kind.change(window.csi[None], empty.astype(_type(setting)), seen)

        def visible(values: np.ndarray) -> Complex64[np.ndarray, "tx rx subcarrier"]:
            return np.where(seen.entries, values, 0).astype(np.complex64)

        return Observations(
            delta=visible(change.delta),
            static=visible(change.static),
            links=links,
            subcarriers=setting.subcarriers,
            layout=setting.layout,
            freq_hz=setting.freq_hz,
            bounds_m=setting.bounds_m,
            time_s=window.end_s,
            kind=setting.reported,
        )

    def _averaged(self, values: np.ndarray) -> np.ndarray:
        """What means are taken of: channels, or their power."""
        return values if self._setting.reported == "complex" else np.abs(values) ** 2


def _type(setting: Setting) -> type:
    return np.complex64 if setting.reported == "complex" else np.float32
