# SPDX-License-Identifier: Apache-2.0
"""A run as evaluation sees it: evidence, truth and the method's own answer, frame by frame."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Protocol

import numpy as np
from jaxtyping import Complex, Float, Float32, Float64

from rfgs_core.bodies.body_prior import Bodies
from rfgs_core.dataset.aperture import whole_csi, whole_layout, whole_static
from rfgs_core.dataset.observed import Observed
from rfgs_core.dataset.sequence import Sequence
from rfgs_core.dataset.splits import HeldOut
from rfgs_core.evaluate.baselines.gaussian_process import krige, krige_level
from rfgs_core.evaluate.baselines.interpolation import fill
from rfgs_core.evaluate.evidence import Evidence
from rfgs_core.evaluate.geometry import best_voxels, reference_points, voxel_budget
from rfgs_core.evaluate.grid import Grid, splat_gaussians
from rfgs_core.evaluate.people import FramePeople, match_people, surface_centroids
from rfgs_core.gaussians.model import Gaussians
from rfgs_core.measure.delay_maps import delay_power_map
from rfgs_core.measure.observations import Kept, Observations
from rfgs_core.radio import Layout, Radio
from rfgs_core.radio.levels import power_of
from rfgs_core.render.view import moving_gaussians
from rfgs_core.run.config import RunConfig
from rfgs_core.seeds import sub_seed
from rfgs_core.settings import Background, Observe, Packets


class EvaluatedRun(Protocol):
    """What evaluation needs of a run; `rfgs_core.run.Run` has it."""

    @property
    def path(self) -> Path:
        """Folder of the run."""
        ...

    @property
    def config(self) -> RunConfig:
        """What was asked for."""
        ...

    @property
    def channel(self) -> Observed:
        """Which channel the run was fitted to."""
        ...

    @property
    def frames(self) -> list[int]:
        """Frames the run was trained on."""
        ...

    @property
    def sequence(self) -> Sequence:
        """The data."""
        ...

    def gaussians(self, frame: int) -> Gaussians:
        """Static Gaussians, then the moving ones of a frame."""
        ...

    def bodies(self, frame: int) -> Bodies | None:
        """Where the bodies of a frame are and how they hold themselves, if the run tells."""
        ...

    def attributes(self, frame: int) -> dict[str, np.ndarray]:
        """Per-Gaussian arrays of the moving ones."""
        ...

    def observations(self, frame: int, kept: Kept | None = None) -> Observations:
        """What training sees of a frame, or would see of some links and subcarriers."""
        ...

    def predict(self, frame: int) -> Complex[np.ndarray, "tx rx subcarrier"]:
        """Csi − csi_static on every measured link, held-out ones included."""
        ...

    def refitted(
        self, frame: int, observations: Observations
    ) -> Complex[np.ndarray, "tx rx subcarrier"]:
        """The same with reflectivities solved from other observations of the frame."""
        ...

    def visible_change(
        self, frame: int, observations: Observations
    ) -> Complex[np.ndarray, "tx rx subcarrier"]:
        """Csi − csi_static as training sees it, NaN where hidden."""
        ...


@dataclass(frozen=True)
class Scene:
    """What all frames of a run have in common."""

    run: EvaluatedRun
    """The run."""
    radio: Radio
    """Its radio."""
    layout: Layout
    """Antenna elements of the radio."""
    held_out: HeldOut
    """What training must not see."""
    grid: Grid
    """Grid over the scene's bounds."""
    voxels: int
    """K, the number of voxels a method may predict."""
    csi_static: Complex[np.ndarray, "tx rx subcarrier"]
    """The empty room, held-out entries included."""
    environment: Complex[np.ndarray, "tx rx subcarrier"]
    """The empty room as kriged from its visible entries."""

    @staticmethod
    def of(run: EvaluatedRun) -> Scene:
        """Reads what all frames share.

        Raises:
            RfgsError: Nothing that moves has a surface.
        """
        sequence, name = run.sequence, run.config.radio
        radio = sequence.radio_spec(name)
        layout = whole_layout(sequence, name, coherent=False)
        held_out = HeldOut.of(sequence.held_out(name), layout, radio.num_subcarriers)
        grid = Grid.over(sequence.bounds_m)
        voxels = voxel_budget(sequence.instances)
        static = whole_static(sequence, name)
        evidence = Evidence.hide(static, static, held_out, layout, radio.freq_hz, grid, voxels)
        environment = fill(evidence.static, evidence, krige, krige_level)
        return Scene(run, radio, layout, held_out, grid, voxels, static, environment)

    @property
    def observe(self) -> Observe:
        """What the radio reports."""
        return self.run.config.settings.observe

    @property
    def background(self) -> Background:
        """What the moving part was told from."""
        return self.run.config.settings.background

    @property
    def packets(self) -> Packets:
        """Which packets of a frame were read."""
        return self.run.config.settings.packets

    def csi(self, frame: int) -> Complex[np.ndarray, "tx rx subcarrier"]:
        """True channel of a frame: predictions are held against it, whatever was observed."""
        return whole_csi(self.run.sequence, self.radio.name, frame)

    def evidence(self, frame: int, score: Float[np.ndarray, "x y z"]) -> Evidence:
        """What baselines may see of a frame, and where the method's own `score` is centred."""
        static, power_map = self.csi_static, None
        if (self.observe, self.background, self.packets) == ("complex", "empty_room", "first"):
            csi = whole_csi(self.run.sequence, self.radio.name, frame, self.run.channel)
        else:
            seen = self.run.observations(frame)
            hidden, static = ~(seen.links[..., None] & seen.subcarriers), seen.static
            # In double precision, so that taking the room off again gives the change as it is.
            csi = np.where(hidden, np.nan, seen.delta.astype(np.complex128) + static)
            if seen.kind == "delay_power":
                power_map = partial(delay_power_map, seen)
        evidence = Evidence.hide(
            csi,
            static,
            self.held_out,
            self.layout,
            self.radio.freq_hz,
            self.grid,
            self.voxels,
            power_map,
        )
        predicted = self.predicted(score)
        centroid_m = predicted.mean(axis=0) if len(predicted) else None
        return evidence.with_method(centroid_m, self.run.bodies(frame))

    def predicted(self, score: Float[np.ndarray, "x y z"]) -> Float64[np.ndarray, "k 3"]:
        """Centres of the voxels that a score predicts [m]."""
        return self.grid.centres(best_voxels(score, self.voxels))

    def people(self, frame: int, score: Float[np.ndarray, "x y z"]) -> FramePeople | None:
        """Who the method's bodies are; None if it does not tell its bodies."""
        bodies = self.run.bodies(frame)
        if bodies is None:
            return None
        # Vehicles and furniture may move as well; bodies are people.
        known = {row["id"] for row in self.run.sequence.instances if row["class"] == "person"}
        moving = surface_centroids(*self.run.sequence.moving_mesh(frame))
        people = {number: place for number, place in moving.items() if number in known}
        return match_people(self.predicted(score), bodies.axes_xy, people)

    def reference(self, frame: int) -> Float64[np.ndarray, "n 3"]:
        """Points on the true moving surface [m]."""
        vertices, faces, _ = self.run.sequence.moving_mesh(frame)
        return reference_points(vertices, faces, seed=sub_seed(0, "reference", frame))

    def score(self, frame: int) -> Float32[np.ndarray, "x y z"]:
        """The method's score: reflected power times mass, of the moving Gaussians."""
        gaussians = moving_gaussians(self.run, frame)
        power_db = np.asarray(self.run.attributes(frame)["rf_power_db"], dtype=np.float64)
        return splat_gaussians(
            self.grid,
            gaussians.means.numpy().astype(np.float64),
            gaussians.covariances.numpy().astype(np.float64),
            power_of(power_db[len(power_db) - len(gaussians) :]),
        )

    @property
    def cross_range_m(self) -> float | None:
        """λR/D: D the width of a device's RX array, R half the scene's diagonal [m]."""
        own = self.layout.rx_device == self.layout.rx_device[0]
        column, xyz = self.layout.rx_column[own], self.layout.rx_xyz[own]
        across = xyz[column == column.max()].mean(axis=0) - xyz[column == column.min()].mean(axis=0)
        width_m = float(np.linalg.norm(across))
        low, high = self.run.sequence.bounds_m
        if width_m == 0.0:
            return None
        return float(self.radio.wavelength_m * 0.5 * np.linalg.norm(high - low) / width_m)
