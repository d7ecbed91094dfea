# SPDX-License-Identifier: Apache-2.0
"""How well a run's static set tells the room that nobody is in, beside what needs no Gaussians.

Everything is held against `csi_static`, held-out entries included. The set sees the run's
background only: the visible part of the capture, or what was learned in its place.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Complex, Float
from scipy.spatial import KDTree

from rfgs_core.background.static_set import StaticSet
from rfgs_core.dataset.sequence import Sequence
from rfgs_core.evaluate.baselines.gaussian_process import krige, krige_level
from rfgs_core.evaluate.baselines.interpolation import completed, fill
from rfgs_core.evaluate.baselines.plain import inverse_distance, linear
from rfgs_core.evaluate.evidence import Evidence
from rfgs_core.evaluate.geometry import reference_points
from rfgs_core.evaluate.rf import RF_KEYS, frame_rf, pool_rf, snr_db
from rfgs_core.evaluate.scene import Scene
from rfgs_core.measure.direct_path import direct_background
from rfgs_core.measure.spectrum import spectral
from rfgs_core.radio.levels import power_of
from rfgs_core.run.calibration import read_calibration
from rfgs_core.run.static import has_static_set, read_static_set
from rfgs_core.seeds import sub_seed

#: Metrics of a background; the first two are added here.
BACKGROUND_KEYS = ("visible_snr_db", "pair_snr_db", *RF_KEYS)
#: Points on the surfaces of a room, a few centimetres apart.
SURFACE_POINTS = 200_000

Channel = Complex[np.ndarray, "tx rx subcarrier"]


@dataclass(frozen=True)
class Backgrounds:
    """The empty room as a run's static set predicts it, on every link and subcarrier."""

    static: StaticSet
    """The set."""
    evidence: Evidence
    """What of the background training sees, in place of the empty room."""
    straight: Channel
    """Direct paths alone."""
    whole: Channel
    """Direct paths and the set."""

    @staticmethod
    def of(scene: Scene) -> Backgrounds | None:
        """Those of a run; None without a static set."""
        run, layout, freq_hz = scene.run, scene.layout, scene.radio.freq_hz
        if not has_static_set(run.path):
            return None
        static, seen = read_static_set(run.path), run.observations(run.frames[0])
        turn = np.ones((), dtype=np.complex64)
        if run.config.settings.calibrate != "none":
            # As devices with the offsets of the capture hear it, like `Run.predict`.
            turn = read_calibration(run.path, run.frames[0]).capture.turn(layout, freq_hz)
        visible = np.where(seen.links[..., None] & seen.subcarriers, seen.static * turn, np.nan)
        evidence = Evidence.hide(
            visible,
            visible,
            scene.held_out,
            layout,
            freq_hz,
            grid=scene.grid,
            voxels=scene.voxels,
        )
        straight, whole = direct_background(seen), static.background(seen)
        parts = ((part * turn).astype(np.complex64) for part in (straight, whole))
        return Backgrounds(static, evidence, *parts)

    @cached_property
    def best(self) -> Channel:
        """Direct paths, the set, and what they leave of the visible background, carried on."""
        return completed(self.whole, self.evidence.static, self.evidence, spectral)


def background_metrics(scene: Scene, own: Backgrounds) -> dict[str, Any]:
    """`rows`, the metrics by method, and `surface_m`, distances of the set to true surfaces."""
    evidence = own.evidence
    answers = {
        "static_set, with residual": own.best,
        "static_set": own.whole,
        "direct paths, with residual": completed(own.straight, evidence.static, evidence, spectral),
        "direct paths": own.straight,
        "spectrum": fill(evidence.static, evidence, spectral, krige_level),
        "gaussian_process": fill(evidence.static, evidence, krige, krige_level),
        "linear": fill(evidence.static, evidence, linear, inverse_distance),
        "zero": np.zeros_like(own.whole),
    }
    return {
        "rows": {name: _metrics(scene, answer) for name, answer in answers.items()},
        "n_gaussians": len(own.static.gaussians),
        "surface_m": surface_distances(own.static, scene.run.sequence),
    }


def _metrics(scene: Scene, predicted: Channel) -> dict[str, float | None]:
    true, held_out = scene.csi_static, scene.held_out
    values = pool_rf([frame_rf(true, predicted, held_out, scene.layout)])
    pairs = held_out.pair_links[..., None] & np.ones(true.shape, dtype=bool)
    for name, where in (("visible_snr_db", held_out.visible), ("pair_snr_db", pairs)):
        error = float(np.sum(np.abs(true - predicted)[where].astype(np.float64) ** 2))
        values[name] = snr_db(error, float(np.sum(np.abs(true[where]).astype(np.float64) ** 2)))
    return {name: values[name] for name in BACKGROUND_KEYS}


def surface_distances(static: StaticSet, sequence: Sequence) -> dict[str, float] | None:
    """Distances of a static set to the true surfaces of the room [m].

    Returns:
        `power_median`: half of Σ|γ|² stands nearer; `median`: of the Gaussians; `chance_median`:
        of as many places anywhere within the bounds. None without geometry or Gaussians.
    """
    if not sequence.files.static_mesh.is_file() or len(static.gaussians) == 0:
        return None
    rng = np.random.default_rng(sub_seed(0, "surface"))
    vertices, faces = sequence.static_mesh()
    tree = KDTree(reference_points(vertices, faces, SURFACE_POINTS, seed=sub_seed(0, "surface")))
    count = len(static.gaussians)
    low, high = sequence.bounds_m
    own = np.asarray(tree.query(static.gaussians.means.numpy().astype(np.float64))[0])
    chance = tree.query(rng.uniform(low, high, (count, 3)))[0]
    power = power_of(static.power_db.astype(np.float64))
    return {
        "power_median": _weighted_median(own, power),
        "median": float(np.median(own)),
        "chance_median": float(np.median(chance)),
    }


def _weighted_median(values: Float[np.ndarray, "N"], weight: Float[np.ndarray, "N"]) -> float:
    """The value below which half of the weight lies."""
    order = np.argsort(values)
    share = np.cumsum(weight[order])
    return float(values[order][np.searchsorted(share, 0.5 * share[-1])])
