# SPDX-License-Identifier: Apache-2.0
"""A trained run on disk: configuration, Gaussians per frame and what they predict."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Complex64, Float64

from rfgs_core.arrays import Shape, load_arrays
from rfgs_core.bodies.body_prior import Bodies
from rfgs_core.dataset import Sequence
from rfgs_core.dataset.observed import Observed
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.gaussians import FEATURE_DIM, Gaussians
from rfgs_core.gaussians.ply import count_ply, read_ply
from rfgs_core.measure.observations import Kept, Observations, Reported, excess_turn, observe
from rfgs_core.model.channel import Channel
from rfgs_core.model.head import HEAD_SHAPES, HEAD_TYPES, RadioHead
from rfgs_core.model.reflectivity import fitted_reflectivities
from rfgs_core.model.unseen_pairs import levelled
from rfgs_core.radio.levels import power_of
from rfgs_core.run.calibration import read_calibration
from rfgs_core.run.config import HEAD_FILE, REMEDY, RunConfig, relative_dataset
from rfgs_core.run.data import trained_sequence
from rfgs_core.run.static import static_gaussians
from rfgs_core.threads import one_torch_thread

#: What a learned background is kept in.
BACKGROUND_FILE = "background.npz"
#: What `rfgs train` keeps of people's limbs, where it tells them.
LIMBS_FILE = "limbs.npz"
_ATTRIBUTES: dict[str, Shape] = {
    "features": ("M", FEATURE_DIM),
    "gamma": ("M", 1),
    "rf_power_db": ("M",),
    "track_id": ("M",),
    "body": ("M",),
}
#: What only Gaussians on the skin of a posed body have.
_ON_SKIN: dict[str, Shape] = {"bone": ("M",), "sigma_m": ("M",)}
_TYPES = {
    "features": "f4",
    "gamma": "c8",
    "rf_power_db": "f4",
    "track_id": "i8",
    "body": "i8",
    "bone": "i8",
    "sigma_m": "f4",
}


@dataclass(frozen=True)
class Run:
    """A run folder; nothing is read before it is asked for."""

    path: Path
    """The folder."""
    config: RunConfig
    """What was asked for, and what it took."""

    @property
    def frames(self) -> list[int]:
        """Frames the run was trained on."""
        return list(self.config.frames)

    @property
    def channel(self) -> Observed:
        """Which channel the run was fitted to."""
        return self.config.settings.channel

    @property
    def sequence(self) -> Sequence:
        """The data the run was trained on.

        Raises:
            RfgsError: The dataset is gone or is not the one of training.
        """
        config = self.config
        place = (self.path / config.dataset).resolve()
        fingerprint = config.dataset_fingerprint
        return trained_sequence(self.path, place, config.sequence, fingerprint, self.channel)

    def with_dataset(self, place: Path) -> Run:
        """The run, once it is written down that its dataset lies elsewhere now."""
        config = replace(self.config, dataset=relative_dataset(self.path, place))
        if config != self.config:
            config.write(self.path)
        return replace(self, config=config)

    @property
    def calibrated(self) -> bool:
        """Whether offsets of devices are taken out before the fit."""
        return self.config.settings.calibrate != "none"

    def observations(self, frame: int, kept: Kept | None = None) -> Observations:
        """What the fit sees of a frame: as reported, without excess path and device offsets."""
        reported = self.as_reported(frame, kept).lengthened(-self.config.settings.excess_m)
        if not self.calibrated:
            return reported
        return read_calibration(self.path, frame).undone(reported)

    def as_reported(self, frame: int, kept: Kept | None = None) -> Observations:
        """The channel of a frame as the run's radios report it."""
        settings = self.config.settings
        return observe(
            self.sequence,
            self.config.radio,
            frame,
            channel=settings.channel,
            kind=settings.observe,
            empty=self._background(),
            packets=settings.packets,
            kept=kept,
        )

    def _background(self) -> Reported | None:
        """The learned background that training keeps; None with an empty-room capture."""
        if self.config.settings.background == "empty_room":
            return None
        shapes = {"empty": ("tx", "rx", "entry")}
        types = {
            "empty": "f4" if self.config.settings.observe in ("power", "delay_power") else "c8"
        }
        return load_arrays(self.path / BACKGROUND_FILE, REMEDY, shapes, types=types)["empty"]

    def ply_path(self, frame: int) -> Path:
        """Moving Gaussians of a frame."""
        return self.path / "gaussians" / f"{frame:06d}.ply"

    def need_frames(self) -> None:
        """Refuses a run that is not fitted to the end, before work that takes all of its frames.

        Raises:
            RfgsError: A frame is not trained yet.
        """
        missing = [frame for frame in self.frames if not self.features_path(frame).exists()]
        if missing:
            raise RfgsError(
                f"{self.path}: {len(missing)} of {len(self.frames)} frames are not trained yet, "
                f"the first is {missing[0]}; run the same `rfgs train` again"
            )

    def features_path(self, frame: int) -> Path:
        """What the PLY of a frame's moving Gaussians does not hold; there once it is fitted."""
        return self.ply_path(frame).with_suffix(".features.npz")

    def attributes(self, frame: int) -> dict[str, np.ndarray]:
        """Per-Gaussian arrays of the moving Gaussians, rows as in the PLY.

        `features`, `gamma`, `rf_power_db`, `track_id` and `body`; where limbs were told also `bone`
        and `sigma_m`.

        Raises:
            RfgsError: The run has no such frame.
            RfgsFormatError: The file is damaged.
        """
        path = self.features_path(frame)
        if not path.exists():
            known = frame in self.frames
            raise RfgsError(
                f"{self.path}: frame {frame} is not trained yet; run the same `rfgs train` again"
                if known
                else f"{self.path} holds no frame {frame}; it has {self.frames}"
            )
        posed = (self.path / LIMBS_FILE).exists()
        shapes = {**_ATTRIBUTES, **_ON_SKIN} if posed else _ATTRIBUTES
        arrays = load_arrays(path, REMEDY, shapes, types=_TYPES)
        count = count_ply(self.ply_path(frame))
        if count != len(arrays["features"]):
            raise RfgsFormatError(
                f"{self.ply_path(frame)}: holds {count} Gaussians, but there are features of "
                f"{len(arrays['features'])}; {REMEDY}"
            )
        return arrays

    def gaussians(self, frame: int) -> Gaussians:
        """Static Gaussians, then the moving ones of a frame."""
        return Gaussians.join(static_gaussians(self.path), self.moving(frame))

    def moving(self, frame: int) -> Gaussians:
        """Moving Gaussians of a frame with their features."""
        features = self.attributes(frame)["features"]
        return read_ply(self.ply_path(frame), REMEDY).to_gaussians(features)

    def bodies(self, frame: int) -> Bodies | None:
        """Where the bodies of a frame are and how they hold themselves.

        Returns:
            None without checkpoint, and of a run that knows of no bodies.

        Raises:
            RfgsFormatError: The checkpoint is damaged, or of a version that told no postures.
        """
        path = checkpoint_path(self.path, frame)
        if not path.exists():
            return None
        shapes = {"axes_xy": ("body", 2), "knees_rad": ("body",)}
        types = dict.fromkeys(shapes, "f8")
        types["lying"] = "f8"
        may_be_nan, lying = ("knees_rad", "lying"), {"lying": ("body", 2)}
        stored = load_arrays(path, REMEDY, shapes, may_be_nan, types=types, optional=lying)
        if len(stored["axes_xy"]) == 0:
            return None
        return Bodies(stored["axes_xy"], stored["knees_rad"], stored.get("lying"))

    @property
    def head(self) -> RadioHead:
        """Decodes reflectivities from features."""
        stored = load_arrays(self.path / HEAD_FILE, REMEDY, HEAD_SHAPES, types=HEAD_TYPES)
        return RadioHead.of_arrays(stored)

    def predict(self, frame: int) -> Complex64[np.ndarray, "tx rx subcarrier"]:
        """Predicted csi − csi_static on every measured link, held-out ones included.

        Device pairs that training did not see get the mean power of reflected powers without
        phases. Of a calibrated run: as devices with the offsets of the empty room's capture see it.
        """
        return self._answer(frame, self.observations(frame), self.moving(frame))

    def refitted(
        self, frame: int, observations: Observations
    ) -> Complex64[np.ndarray, "tx rx subcarrier"]:
        """What `predict` says once reflectivities are solved from some of the visible entries.

        What the run was fitted to says nothing about how well it predicts; entries that are left
        out here do. Gaussians stay where they are. Radios without phases have no such answer.

        Args:
            frame: Which frame.
            observations: What to solve from, of the run's own `observations`.
        """
        gaussians, head = self.moving(frame), self.head
        power = torch.from_numpy(self._power(frame).astype(np.float32))
        with one_torch_thread():
            gamma = fitted_reflectivities(
                observations,
                head,
                gaussians,
                power,
                unexplained=self.config.settings.unexplained,
                iterations=self.config.settings.solver_steps,
            )
        assert gamma is not None
        features = head.with_gamma(gaussians.features, gamma)
        return self._answer(frame, observations, replace(gaussians, features=features))

    def visible_change(
        self, frame: int, observations: Observations
    ) -> Complex64[np.ndarray, "tx rx subcarrier"]:
        """Csi − csi_static of the run's observations, NaN where hidden, to hold `predict` against.

        Of a calibrated run with the offsets of the empty room's capture, as `predict` says it.
        """
        visible = observations.links[..., None] & observations.subcarriers
        unknown = np.complex64(complex(np.nan, np.nan))
        return self._as_captured(
            frame, observations, np.where(visible, observations.delta, unknown)
        )

    def _power(self, frame: int) -> Float64[np.ndarray, "M"]:
        """Reflected power of each moving Gaussian [m²]."""
        return power_of(self.attributes(frame)["rf_power_db"].astype(np.float64))

    def _answer(
        self, frame: int, observations: Observations, gaussians: Gaussians
    ) -> Complex64[np.ndarray, "tx rx subcarrier"]:
        """What Gaussians do to every measured link."""
        everything = np.ones(len(observations.freq_hz), dtype=bool)
        channel = Channel.of(observations, observations.layout.measured, everything)
        head = self.head
        with torch.no_grad():
            change = channel.change(head, gaussians).numpy()
        csi = np.zeros_like(observations.delta)
        csi[channel.tx, channel.rx] = change
        csi = levelled(
            csi,
            visible=observations.links,
            layout=observations.layout,
            freq_hz=observations.centre_hz,
            head=head,
            gaussians=gaussians,
            power=self._power(frame),
        )
        return self._as_captured(frame, observations, csi)

    def _as_captured(
        self,
        frame: int,
        observations: Observations,
        csi: Complex64[np.ndarray, "tx rx subcarrier"],
    ) -> Complex64[np.ndarray, "tx rx subcarrier"]:
        """With excess path, and offsets that devices had when the empty room was captured."""
        if excess_m := self.config.settings.excess_m:
            csi = (csi * excess_turn(observations.freq_hz, excess_m)).astype(np.complex64)
        if not self.calibrated:
            return csi
        offsets = read_calibration(self.path, frame).capture
        turn = offsets.turn(observations.layout, observations.freq_hz)
        return (csi * turn).astype(np.complex64)


def checkpoint_path(run: Path, frame: int) -> Path:
    """State of a fitted frame in a run's folder."""
    return run / "checkpoints" / f"{frame:06d}.npz"


def open_run(path: Path) -> Run:
    """Opens a run folder.

    Raises:
        RfgsError: There is no run.
        RfgsFormatError: It is of another version, or damaged.
    """
    return Run(path, RunConfig.read(path))
