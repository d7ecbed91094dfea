# SPDX-License-Identifier: Apache-2.0
"""`rfgs predict`: the channel at antenna positions that nobody recorded."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

if TYPE_CHECKING:
    import numpy as np

    from rfgs_core.predict import Prediction
    from rfgs_core.propagation import RadioGaussians
    from rfgs_core.run import Run


@dataclass(frozen=True)
class PredictArgs:
    """Predicts the channel, its delays and directions at antenna positions nobody recorded.

    The prediction is what the fitted Gaussians scatter, plus the free-space direct path between
    the antennas with the Gaussians' shadow on it. The paths by way of walls are known along
    recorded links only, so they are missing here; near walls a real channel holds more. With
    --room the run's static Gaussians stand in for them, as a guess (`rfgs eval` tells how good on
    a device pair that training did not see). Also prints what the Gaussians reflect and what
    their frequency behaviour says of the material.

    Example: rfgs predict run --tx 0.5,0.5,1.2 --rx 3.0,4.0,1.2 --rx -1.0,2.0,1.2
    """

    run: tyro.conf.Positional[Path]
    """Folder of a trained run."""
    tx: str
    """Transmitting antenna x,y,z [m]."""
    rx: Annotated[tuple[str, ...], tyro.conf.UseAppendAction] = ()
    """Receiving antenna x,y,z [m]; may be given several times."""
    frame: int | None = None
    """Which of the run's frames; the first when left out."""
    out: Path | None = None
    """File for the arrays, NAME.npz, with the picture NAME.png beside it; named after the frame
    and kept in RUN/predictions when left out."""
    array: bool = False
    """Put the radio's own receiving array at each --rx instead of a single antenna."""
    facing: str | None = None
    """Point x,y,z [m] that the arrays are turned to; the middle of the person when left out."""
    room: bool = False
    """Add what the static Gaussians of the run scatter (`rfgs train --static-set`)."""
    also: Annotated[tuple[Path, ...], tyro.conf.UseAppendAction] = ()
    """Runs of other radios on the same frame, for the material: bands far apart tell more."""


def run(args: PredictArgs) -> int:
    """Writes arrays and picture, prints the table; exit code 0."""
    from rfgs_core.errors import RfgsError
    from rfgs_core.predict.antennas import positions
    from rfgs_core.predict.arrays import note_of
    from rfgs_core.run import open_run

    tx_xyz, rx_xyz = positions(args.tx, args.rx)
    if args.facing is not None and not args.array:
        raise RfgsError(f"--facing {args.facing}: turns arrays; add --array, or leave it out")
    out = _target(args)
    trained = open_run(args.run)
    frame = trained.frames[0] if args.frame is None else args.frame
    prediction, arrays = _predict(trained, frame, tx_xyz, rx_xyz, args)
    lines = [*_table(prediction, arrays), *_reflectors(arrays), _material(trained, frame, args)]
    path = out or args.run / "predictions" / f"{frame:06d}.npz"
    _write(path, arrays)
    if excess_m := trained.config.settings.excess_m:
        lines.append(
            f"echoes lack the {excess_m:.1f} m that paths over people are longer in this run: add "
            "them where antennas stand behind the same wall"
        )
    lines += [f"holds: {note_of(arrays)}", f"{path} and {path.with_suffix('.png').name} written"]
    sys.stdout.write("\n".join(lines) + "\n")
    return 0


def _target(args: PredictArgs) -> Path | None:
    from rfgs_core.errors import RfgsError

    if args.out is not None and args.out.suffix != ".npz":
        raise RfgsError(f"--out {args.out}: expected a file name that ends in .npz")
    return args.out


def _predict(
    trained: Run, frame: int, tx_xyz: np.ndarray, rx_xyz: np.ndarray, args: PredictArgs
) -> tuple[Prediction, dict[str, np.ndarray]]:
    import numpy as np

    from rfgs_core.predict.antennas import check_positions, read_position, receiving_array
    from rfgs_core.predict.arrays import prediction_arrays
    from rfgs_core.predict.echoes import echoes_at, reflectors
    from rfgs_core.predict.places import check_in_scene
    from rfgs_core.predict.prediction import predict_channel

    name = trained.config.radio
    radio = trained.sequence.radio_spec(name)
    devices = np.array([device.position_m for device in trained.sequence.devices(name)])
    named = [("--tx", tx_xyz), *(("--rx", place) for place in rx_xyz)]
    for sentence in check_in_scene(trained.sequence, named, devices):
        sys.stderr.write(f"{sentence}\n")
    gaussians = trained.head.radio_gaussians(trained.moving(frame))
    means = gaussians.means.numpy().astype(np.float64)
    check_positions(tx_xyz, rx_xyz, means, 0.5 * radio.wavelength_m)
    elements, boresight_rad = rx_xyz[:, None], []
    if args.array:
        middle = (
            means.mean(axis=0) if args.facing is None else read_position(args.facing, "--facing")
        )
        arrays = [receiving_array(radio, place, middle) for place in rx_xyz]
        elements = np.stack([xyz for xyz, _ in arrays])
        boresight_rad = [yaw for _, yaw in arrays]
    room = _room(trained, np.concatenate([tx_xyz[None], elements.reshape(-1, 3)]), args)
    prediction = predict_channel(gaussians, tx_xyz, elements, radio.freq_hz, room)
    echoes = echoes_at(gaussians, tx_xyz, rx_xyz, radio.freq_hz)
    own = reflectors(gaussians, radio.freq_hz)
    return prediction, prediction_arrays(prediction, boresight_rad, means, echoes, own)


def _room(trained: Run, antennas: np.ndarray, args: PredictArgs) -> RadioGaussians | None:
    """The static set, less what stands too near to the new antennas."""
    from rfgs_core.errors import RfgsError
    from rfgs_core.run.static import has_static_set, read_static_set

    if not args.room:
        return None
    if not has_static_set(trained.path):
        raise RfgsError(
            f"--room: {trained.path} has no static Gaussians; train it with --static-set 2000"
        )
    static = read_static_set(trained.path).away_from(antennas)
    return static.head.radio_gaussians(static.gaussians)


def _write(path: Path, arrays: dict[str, np.ndarray]) -> None:
    from rfgs_core.figures.predictions import write_prediction_chart
    from rfgs_core.predict.arrays import write_prediction

    write_prediction_chart(path.with_suffix(".png"), arrays)
    write_prediction(path, arrays)


def _table(prediction: Prediction, arrays: dict[str, np.ndarray]) -> list[str]:
    """One line per receiver: the direct path, its shadow, and the strongest scattering."""
    import numpy as np

    from rfgs_core.predict.prediction import gain_db
    from rfgs_core.predict.spectra import strongest
    from rfgs_core.radio.constants import SPEED_OF_LIGHT

    rows = [
        "rx [m]                    direct [ns]  gain [dB]  shadow [dB]"
        "  echo [ns]  echo [dB]  from az, el [°]"
    ]
    for index, place in enumerate(prediction.rx_xyz):
        straight_m = float(np.linalg.norm(place - prediction.tx_xyz))
        free_db = gain_db(prediction.csi_free[index])
        shadow_db = gain_db(prediction.csi_direct[index]) - free_db
        peak_s, azimuth_deg, elevation_deg = strongest(arrays, index)
        spelt = ", ".join(f"{value:.2f}" for value in place)
        rows.append(
            f"{spelt:<24}  {straight_m / SPEED_OF_LIGHT * 1e9:11.2f}  {free_db:9.1f}"
            f"  {shadow_db:11.2f}  {peak_s * 1e9:9.2f}"
            f"  {gain_db(prediction.csi_scatter[index]):9.1f}"
            f"  {azimuth_deg:7.0f}, {elevation_deg:.0f}"
        )
    return rows


def _reflectors(arrays: dict[str, np.ndarray]) -> list[str]:
    """What the Gaussians reflect, in two lines."""
    import numpy as np

    from rfgs_core.radio.levels import decibels

    rcs_m2 = arrays["gaussian_rcs_m2"]
    total_db = decibels(float(rcs_m2.sum()))
    half = int(np.searchsorted(np.cumsum(np.sort(rcs_m2)[::-1]), 0.5 * rcs_m2.sum())) + 1
    return [
        f"{len(rcs_m2)} Gaussians reflect {total_db:.1f} dBsm in sum (|gamma|², no phases); "
        f"the strongest {half} hold half of it"
    ]


def _material(trained: Run, frame: int, args: PredictArgs) -> str:
    """The material hint over this run's band and those of `--also`."""
    from rfgs_core.errors import RfgsError
    from rfgs_core.predict.material import Levels, levels_of, material_sentence, material_weights
    from rfgs_core.run import open_run

    runs = [trained, *(open_run(path) for path in args.also)]
    parts = []
    for other in runs:
        if other.sequence.path != trained.sequence.path:
            raise RfgsError(f"--also {other.path}: trained on another sequence; expected the same")
        name = other.config.radio
        radio, layout = other.sequence.radio_spec(name), other.sequence.layout(name)
        gaussians = other.head.radio_gaussians(other.moving(frame))
        heard = levels_of(gaussians, layout, radio.freq_hz)
        if heard is None:
            return f"material: not judged; no device of {name} hears its own echoes"
        parts.append(heard)
    levels = Levels.join(parts)
    rows = trained.sequence.instances
    surface_m2 = sum(float(row.get("nominal_surface_m2") or 0.0) for row in rows)
    if surface_m2 <= 0:
        return "material: not judged; no instance of this sequence has a nominal_surface_m2"
    sentence = material_sentence(levels, material_weights(levels, surface_m2))
    return f"material: {sentence}"
