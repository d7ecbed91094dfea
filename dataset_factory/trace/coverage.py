# SPDX-License-Identifier: Apache-2.0
"""How loud each transmitter of a scene is over a level plane, by Sionna RT's radio maps."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from dataset_factory.scene.bundle import read_bundle
from dataset_factory.scene.devices import choose_devices
from dataset_factory.scene.radios import SCENE_RADIO, chosen_radios, scene_radio
from dataset_factory.trace.sionna_scene import sionna_scene
from rfgs_core.errors import RfgsError
from rfgs_core.files import write_json
from rfgs_core.radio import layout
from rfgs_core.radio.sites import owners

#: Gain of cells that no ray reaches [dB].
NOTHING_DB = -300.0
#: A map of more cells than this is a mistake in the cell's size.
_MOST_CELLS = 4_000_000


@dataclass(frozen=True)
class Coverage:
    """Path gains over a plane."""

    radio: str
    """Name of the radio."""
    carrier_hz: float
    """Carrier at which was traced [Hz]."""
    corner_m: tuple[float, float, float]
    """Corner of the first cell, least x and y; the plane's height is its z [m]."""
    cell_m: float
    """Side of the square cells [m]."""
    devices: list[str]
    """Name of the device of each transmitter."""
    gain_db: Float[np.ndarray, "tx y x"]
    """Power that an isotropic antenna receives over the power sent [dB]; `NOTHING_DB` where no ray
    arrives."""

    def write(self, file: Path) -> None:
        """Writes JSON that the add-on reads."""
        rows = np.round(self.gain_db.astype(float), 2).tolist()
        write_json(file, {**vars(self), "corner_m": list(self.corner_m), "gain_db": rows})


def trace_coverage(
    bundle: Path,
    radio: str,
    height_m: float = 1.2,
    cell_m: float = 0.1,
    depth: int = 3,
    frame: int | None = None,
    samples: int = 1_000_000,
    diffraction: bool = False,
) -> Coverage:
    """Traces the radio map of every transmitter over the bounds of a scene.

    Args:
        bundle: Folder that the add-on's `export` wrote.
        radio: A preset, a file that describes a radio, or `scene`.
        height_m: Height of the plane above the lower end of the scene's bounds [m].
        cell_m: Side of the cells [m].
        depth: Most interactions of a path; 0 is the line of sight alone.
        frame: Frame that moving things are posed at, people as bodies of skin; None without them.
        samples: Rays per transmitter.
        diffraction: Also trace edges, which takes about three times as long.

    Raises:
        RfgsError: The bundle or the radio is none, or the cells are too many or none.
    """
    found = read_bundle(bundle)
    low, high = found.bounds_m
    if not 0.0 < height_m < high[2] - low[2]:
        raise RfgsError(
            f"height: expected within the scene's {high[2] - low[2]:.2f} m, got {height_m:g} m"
        )
    if not cell_m > 0.0 or np.prod((high - low)[:2] / cell_m) > _MOST_CELLS:
        raise RfgsError(f"cell: expected at most {_MOST_CELLS:,} cells, got a side of {cell_m:g} m")
    (spec,) = chosen_radios((radio,)).values()
    spec = scene_radio(found) if radio == SCENE_RADIO else spec
    devices, _ = choose_devices(found, spec)
    scene = sionna_scene(bundle, radio, frame)
    import mitsuba as mi
    import sionna.rt as rt

    count = np.maximum(np.ceil((high - low)[:2] / cell_m).astype(int), 1)
    centre = low[:2] + 0.5 * count * cell_m
    solved = rt.RadioMapSolver()(
        scene,
        center=mi.Point3f(*centre.tolist(), float(low[2]) + height_m),
        orientation=mi.Point3f(0.0, 0.0, 0.0),
        size=mi.Point2f(*(count * cell_m).tolist()),
        cell_size=mi.Point2f(cell_m, cell_m),
        samples_per_tx=samples,
        max_depth=depth,
        diffraction=diffraction,
        seed=1,
    )
    gain = np.array(solved.path_gain, dtype=float)
    return Coverage(
        radio=radio,
        carrier_hz=float(spec.centre_hz),
        corner_m=(float(low[0]), float(low[1]), float(low[2]) + height_m),
        cell_m=cell_m,
        devices=[devices[row].name for row in owners(layout(spec, devices))[0]],
        gain_db=10.0 * np.log10(np.maximum(gain, 10.0 ** (NOTHING_DB / 10.0))),
    )
