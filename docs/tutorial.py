# SPDX-License-Identifier: Apache-2.0
r"""A tour of a dataset: its contents, channels, delays, angles, pictures and labels.

    python docs/tutorial.py

tours the small dataset that comes with the package; one of your own takes about two minutes:

    rfgs-factory generate living_room_walk --radio wifi --frames 10:30:10 --cameras 4 \
        --resolution 128 --out my_dataset
    python docs/tutorial.py my_dataset

It prints what it finds and writes one picture, tutorial.png. Every field it uses is explained in
docs/dataset.md.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from torch.utils.data import DataLoader

from rfgs_core import open_dataset
from rfgs_core.dataset import Dataset, Sequence
from rfgs_core.dataset.torch_dataset import FrameDataset
from rfgs_core.errors import RfgsError
from rfgs_core.example import example_folder
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.layout import rotation
from rfgs_core.radio.levels import decibels
from rfgs_core.render.cameras import Camera
from rfgs_core.skeleton import PARENTS

#: Delay bins per subcarrier; the band's resolution stays, the curve gets smooth.
OVERSAMPLING = 8


def print_contents(dataset: Dataset, sequence: Sequence, radio: str) -> None:
    """Step 1: what there is."""
    print(f"{dataset.path}: holds {', '.join(dataset.has)}")
    print(f"sequence {sequence.name}: frames {sequence.frames} at {sequence.fps:g} fps")
    print(f"scene {np.ptp(sequence.bounds_m, axis=0).round(2)} m, {len(sequence.cameras)} cameras")
    print(f"radios {', '.join(sequence.radios)}; {radio} at depth {sequence.trace_depth(radio)}")
    # xarray: nothing is read before it is used.
    print(sequence.radio(radio))
    for number, device in enumerate(sequence.devices(radio)):
        print(f"device {number} {device.name} at {np.round(device.position_m, 2)} m")


def delay_profile(
    sequence: Sequence, radio: str, links: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Step 2: from subcarriers to path lengths.

    Args:
        sequence: Gives the band.
        radio: Which radio.
        links: Channels (..., subcarrier).

    Returns:
        Responses (..., delay), and the length of the path that each delay stands for [m].
    """
    spec = sequence.radio_spec(radio)
    # A window trades a little resolution for side lobes that do not hide weak paths.
    window = np.hanning(spec.num_subcarriers)
    count = OVERSAMPLING * spec.num_subcarriers
    response = np.fft.ifft(links * window, n=count, axis=-1) * count / window.sum()
    length_m = np.arange(count) * spec.unambiguous_path_m / count
    return response, length_m


def delay_angle(
    sequence: Sequence, radio: str, csi: np.ndarray, pair: tuple[int, int]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Step 3: where the power of one device pair comes from, and how far it has travelled.

    Elements of one device are phase-coherent, so they can be steered: a wave from angle θ reaches
    the element at y along the array by y sin θ earlier. Rows are added in power.

    Returns:
        Power (angle, delay), angle from the boresight towards the device's +y [°], length [m].
    """
    layout, spec = sequence.layout(radio), sequence.radio_spec(radio)
    tx, rx = layout.tx_device == pair[0], layout.rx_device == pair[1]
    response, length_m = delay_profile(sequence, radio, csi[np.ix_(tx, rx)])
    device = sequence.devices(radio)[pair[1]]
    local = (layout.rx_xyz[rx] - np.asarray(device.position_m)) @ rotation(device.quat_wxyz)
    angle_deg = np.linspace(-90.0, 90.0, 181)
    earlier_m = np.sin(np.deg2rad(angle_deg))[:, None] * local[:, 1]
    steering = np.exp(-2j * np.pi * spec.centre_hz / SPEED_OF_LIGHT * earlier_m)
    power = np.zeros((len(angle_deg), len(length_m)))
    for height in np.unique(local[:, 2].round(6)):
        row = local[:, 2].round(6) == height
        beams = np.einsum("ar,trd->tad", steering[:, row], response[:, row])
        power += (np.abs(beams) ** 2).sum(axis=0)
    return power, angle_deg, length_m


def seen_from(
    sequence: Sequence, radio: str, pair: tuple[int, int], point: np.ndarray
) -> tuple[float, float]:
    """Angle [°] and path length [m] at which a device pair should see a scatterer."""
    layout, device = sequence.layout(radio), sequence.devices(radio)[pair[1]]
    local = (point - np.asarray(device.position_m)) @ rotation(device.quat_wxyz)
    back = np.linalg.norm(local)
    out = np.linalg.norm(point - layout.tx_xyz[layout.tx_device == pair[0]].mean(axis=0))
    return float(np.rad2deg(np.arcsin(local[1] / back))), float(out + back)


def draw_channel(axes: list[Axes], sequence: Sequence, radio: str, frame: int) -> None:
    """Amplitude, delay profile and delay–angle picture of one frame."""
    csi, static = sequence.csi(radio, frame), sequence.csi_static(radio)
    layout, spec = sequence.layout(radio), sequence.radio_spec(radio)
    # A pair of different devices, unless the radio only hears itself.
    pair = max(layout.device_pairs, key=lambda ab: ab[0] != ab[1])
    band = (spec.freq_min_hz / 1e9, spec.freq_max_hz / 1e9)
    tx, rx = layout.tx_device == pair[0], layout.rx_device == pair[1]
    links = csi[np.ix_(tx, rx)]
    extent = (*band, links.shape[1] - 0.5, -0.5)
    axes[0].imshow(decibels(np.abs(links[0]) ** 2), aspect="auto", extent=extent)
    axes[0].set(title=f"|csi| [dB], device {pair[0]} to {pair[1]}")
    axes[0].set(xlabel="frequency [GHz]", ylabel="receiving element")

    for value, name in ((csi, "csi"), (static, "csi_static"), (csi - static, "difference")):
        response, length_m = delay_profile(sequence, radio, value[np.ix_(tx, rx)])
        axes[1].plot(length_m, decibels((np.abs(response) ** 2).mean(axis=(0, 1))), label=name)
    direct_m = np.linalg.norm(layout.tx_xyz[tx].mean(axis=0) - layout.rx_xyz[rx].mean(axis=0))
    axes[1].axvline(float(direct_m), color="black", ls=":", label="straight line")
    longest_m = 2.0 * float(np.linalg.norm(np.ptp(sequence.bounds_m, axis=0)))
    top = max(np.max(line.get_ydata()) for line in axes[1].lines[:3])
    axes[1].set(title="delay profile [dB]", xlabel="path length [m]")
    axes[1].set(xlim=(0.0, longest_m), ylim=(top - 80.0, top + 5.0))
    axes[1].legend(fontsize=7)

    power, angle_deg, length_m = delay_angle(sequence, radio, csi - static, pair)
    level, extent = decibels(power).T, (angle_deg[0], angle_deg[-1], length_m[0], length_m[-1])
    axes[2].imshow(level, origin="lower", aspect="auto", extent=extent, vmin=level.max() - 30.0)
    for pelvis in sequence.joints(frame)[:, 0]:
        angle, length = seen_from(sequence, radio, pair, pelvis)
        axes[2].plot(angle, length, "x", color="cyan", ms=9, mew=2)
    axes[2].set(title="what moves: delay over angle", ylim=(0.0, longest_m))
    axes[2].set(xlabel="angle from boresight [°]", ylabel="path length [m]")


def draw_pictures(axes: list[Axes], sequence: Sequence, frame: int) -> None:
    """Step 4: the same frame as a camera sees it, and joints projected into the picture."""
    row = sequence.cameras[0]
    camera = Camera.from_dict(row)
    # Pixel (row r, column c) covers [c, c + 1] × [r, r + 1].
    extent = (0.0, camera.width, camera.height, 0.0)
    axes[0].imshow(sequence.image(camera.name, frame), extent=extent)
    for skeleton in sequence.joints(frame):
        pixel, _ = camera.project(skeleton)
        for joint, parent in enumerate(PARENTS):
            if parent >= 0:
                axes[0].plot(*pixel[[joint, parent]].T, "o-", color="cyan", ms=2, lw=1)
    axes[0].set(title=f"{camera.name}, frame {frame}, with joints")
    depth_m = sequence.depth(camera.name, frame)
    shown = axes[1].imshow(np.where(np.isfinite(depth_m), depth_m, np.nan), extent=extent)
    person = sequence.mask(camera.name, frame) > 0
    centres = np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5
    axes[1].contour(*centres, person, levels=[0.5], colors="red")
    axes[1].set(title="depth [m], outline of the mask")
    axes[1].figure.colorbar(shown, ax=axes[1])
    for axis in axes:
        axis.set(xlim=extent[:2], ylim=extent[2:])
        axis.set_axis_off()


def draw_over_time(axis: Axes, sequence: Sequence, radio: str) -> None:
    """Step 5: all frames through a torch DataLoader."""
    loader = DataLoader(FrameDataset(sequence, radio), batch_size=2)
    times_s, ratios = [], []
    for batch in loader:
        print(f"batch: frames {batch['frame'].tolist()}, csi {tuple(batch['csi'].shape)}")
        change = (batch["csi"] - batch["csi_static"]).abs().square().sum(dim=(1, 2, 3))
        ratios += (change / batch["csi_static"].abs().square().sum(dim=(1, 2, 3))).tolist()
        times_s += batch["time_s"].tolist()
    axis.plot(times_s, decibels(np.array(ratios)), "o-")
    axis.set(title="what moves / what stands still [dB]", xlabel="time [s]")


def tour(path: Path, radio: str | None, out: Path) -> None:
    """Takes all steps and writes the picture.

    Raises:
        RfgsError: There is no dataset, or no such radio in it.
    """
    dataset = open_dataset(path)
    sequence = dataset.sequence(dataset.sequences[0])
    radio = radio or sequence.radios[0]
    frame = sequence.frames[0]
    print_contents(dataset, sequence, radio)
    figure = Figure(figsize=(13, 8), layout="constrained")
    axes = list(figure.subplots(2, 3).flat)
    if "images" in dataset.has:
        draw_pictures(axes[:2], sequence, frame)
    else:
        for axis in axes[:2]:
            axis.set_axis_off()
    draw_over_time(axes[2], sequence, radio)
    draw_channel(axes[3:], sequence, radio, frame)
    for person, action in zip(sequence.people(frame), sequence.actions(frame), strict=True):
        print(f"frame {frame}: person with instance id {person}: {action or 'unknown action'}")
    figure.savefig(out, dpi=100)
    print(f"{out}: written")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "dataset", type=Path, nargs="?", help="folder of the dataset; default: the package's own"
    )
    parser.add_argument("--radio", help="which radio; default: the first")
    parser.add_argument("--out", type=Path, default=Path("tutorial.png"), help="picture to write")
    args = parser.parse_args()
    try:
        tour(args.dataset or example_folder() / "dataset", args.radio, args.out)
    except RfgsError as error:
        parser.exit(2, f"error: {error}\n")
