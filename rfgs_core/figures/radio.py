# SPDX-License-Identifier: Apache-2.0
"""Channels as pictures: amplitude, delay over time, and delay–angle images."""

from __future__ import annotations

import numpy as np
from jaxtyping import Complex, Float

from rfgs_core.evaluate.scene import Scene
from rfgs_core.figures.style import INK, METHOD, figure_uri, new_figure
from rfgs_core.radio.delay import delay_profile, hann, path_lengths_m
from rfgs_core.radio.layout import rotation
from rfgs_core.radio.levels import decibels

#: Dynamic range of all images of power [dB].
RANGE_DB = 30.0
#: Zero padding of delay transforms.
PADDING = 4
#: Devices of which delay–angle images are drawn.
_MOST_DEVICES = 8
#: Directions of delay–angle images [degree].
ANGLES_DEG = np.linspace(-85.0, 85.0, 121)


def channel_chart(scene: Scene, frame: int) -> str:
    """|H| and |ΔH| of one frame, and the delay profile of ΔH over all frames."""
    csi = scene.csi(frame)
    tx = 0
    links = np.flatnonzero(scene.layout.measured[tx])
    mhz = scene.radio.freq_hz / 1e6
    with new_figure(10.5, 3.4) as figure:
        axes = figure.subplots(1, 3)
        panels = (("|H|", csi[tx, links]), ("|H − H static|", (csi - scene.csi_static)[tx, links]))
        for axis, (title, values) in zip(axes, panels, strict=False):
            level = decibels(np.abs(values) ** 2)
            image = axis.imshow(
                level,
                aspect="auto",
                cmap="magma",
                vmin=level.max() - RANGE_DB,
                extent=(mhz[0], mhz[-1], len(links), 0),
            )
            axis.set(title=f"{title} [dB], frame {frame}", xlabel="frequency [MHz]")
            figure.colorbar(image, ax=axis, shrink=0.8).outline.set_visible(False)  # type: ignore[operator]
        axes[0].set_ylabel(f"receiving element, transmitter {tx}")
        _delay_over_time(scene, axes[2], figure)
        return figure_uri(figure)


def _delay_over_time(scene: Scene, axis, figure) -> None:
    """Mean delay profile of ΔH per frame."""
    profiles = []
    for frame in scene.run.frames:
        delta = (scene.csi(frame) - scene.csi_static)[scene.layout.measured]
        profiles.append(np.mean(np.abs(padded_profile(delta)) ** 2, axis=0))
    length_m = path_lengths_m(scene.radio, PADDING)
    shown = length_m <= _longest_m(scene)
    level = decibels(np.stack(profiles)[:, shown].T)
    image = axis.imshow(
        level,
        aspect="auto",
        origin="lower",
        cmap="magma",
        vmin=level.max() - RANGE_DB,
        extent=(-0.5, len(profiles) - 0.5, 0.0, float(length_m[shown][-1])),
    )
    step = max(1, len(profiles) // 6)
    axis.set_xticks(range(0, len(profiles), step), scene.run.frames[::step])
    axis.set(title="delay profile of H − H static [dB]", xlabel="frame", ylabel="path length [m]")
    figure.colorbar(image, ax=axis, shrink=0.8).outline.set_visible(False)


def delay_angle_chart(scene: Scene, frame: int, centroid_m: Float[np.ndarray, "3"]) -> str:
    """One delay–angle image of ΔH per device, with the true person marked.

    Angles are azimuths in the device's own frame, left positive; rows of the array and
    transmitting elements add in power.
    """
    # Of antennas that move, the first few places stand for all.
    devices = scene.run.sequence.devices(scene.radio.name)[:_MOST_DEVICES]
    delta = scene.csi(frame) - scene.csi_static
    with new_figure(2.7 * len(devices) + 0.4, 3.2) as figure:
        axes = np.atleast_1d(figure.subplots(1, len(devices), sharey=True))
        for index, (device, axis) in enumerate(zip(devices, axes, strict=True)):
            world = rotation(device.quat_wxyz)
            tx_device = _partner(scene, index)
            power = _delay_angle(scene, delta, tx_device, index, world)
            length_m = path_lengths_m(scene.radio, PADDING)
            shown = length_m <= _longest_m(scene)
            level = decibels(power[shown])
            axis.pcolormesh(
                ANGLES_DEG,
                length_m[shown],
                level,
                cmap="magma",
                vmin=level.max() - RANGE_DB,
                shading="auto",
                rasterized=True,
            )
            angle, path = _marker(scene, centroid_m, tx_device, index, world)
            axis.plot(angle, path, "o", ms=11, mfc="none", mec="#5ad1ff", mew=1.6)
            who = "own transmitter" if tx_device == index else f"transmitter {tx_device}"
            axis.set(title=f"device {index}, {who}", xlabel="azimuth [°]")
        axes[0].set_ylabel("path length [m]")
        return figure_uri(figure)


def _delay_angle(
    scene: Scene,
    delta: Complex[np.ndarray, "tx rx subcarrier"],
    tx_device: int,
    rx_device: int,
    world: Float[np.ndarray, "3 3"],
) -> Float[np.ndarray, "delay angle"]:
    """Power over path length and azimuth."""
    layout = scene.layout
    tx, rx = (elements.ravel() for elements in layout.block_of(tx_device, rx_device))
    columns = np.unique(layout.rx_column[rx])
    local_y = (layout.rx_xyz[rx] - layout.rx_xyz[rx].mean(axis=0)) @ world[:, 1]
    by_column = np.stack([rx[layout.rx_column[rx] == c] for c in columns])
    y = np.array([local_y[layout.rx_column[rx] == c].mean() for c in columns])
    profile = padded_profile(delta[np.ix_(tx, by_column.ravel())])
    profile = profile.reshape(len(tx), *by_column.shape, -1)
    k = 2.0 * np.pi / scene.radio.wavelength_m
    # A wave from azimuth φ is ahead by k y sin φ at local y.
    steer = np.exp(-1j * k * np.outer(np.sin(np.radians(ANGLES_DEG)), y))
    beams = np.einsum("ac,tcrd->tard", steer * hann(len(y)), profile)
    return np.mean(np.abs(beams) ** 2, axis=(0, 2)).T


def _marker(
    scene: Scene,
    point_m: Float[np.ndarray, "3"],
    tx_device: int,
    rx_device: int,
    world: Float[np.ndarray, "3 3"],
) -> tuple[float, float]:
    """Azimuth [degree] and path length [m] at which a point appears."""
    sender, receiver = scene.layout.centres_of(tx_device, rx_device)
    towards = world.T @ (point_m - receiver)
    sine = towards[1] / np.linalg.norm(towards)
    path = np.linalg.norm(point_m - receiver) + np.linalg.norm(point_m - sender)
    return float(np.degrees(np.arcsin(sine))), float(path)


def _partner(scene: Scene, rx_device: int) -> int:
    """The device's own transmitter where it is measured, else the first one that is."""
    measured = [a for a, b in scene.layout.device_pairs if b == rx_device]
    return rx_device if rx_device in measured else measured[0]


def padded_profile(csi: Complex[np.ndarray, "*link subcarrier"]) -> Complex[np.ndarray, "..."]:
    """Delay profile as charts show it."""
    return delay_profile(csi, hann(csi.shape[-1]), PADDING)


def _longest_m(scene: Scene) -> float:
    """Path lengths beyond are not shown [m]: twice the diagonal of the scene."""
    low, high = scene.run.sequence.bounds_m
    return min(2.0 * float(np.linalg.norm(high - low)), scene.radio.unambiguous_path_m)


def f10_chart(frames: list[dict], shown: dict[str, tuple[str, str]]) -> str:
    """F10 of every frame, the method beside chosen baselines.

    Args:
        frames: `frames` of `metrics.json`.
        shown: Baseline name → words for it and its colour.
    """
    with new_figure(10.5, 3.4) as figure:
        axis = figure.subplots()
        number = [row["frame"] for row in frames]
        own = [row["geometry"]["f10"] for row in frames]
        for name, (words, colour) in shown.items():
            of = {row["frame"]: row["baselines"].get(name, {}).get("geometry") for row in frames}
            known = {frame: values["f10"] for frame, values in of.items() if values}
            if known:
                axis.plot(
                    *zip(*known.items(), strict=True),
                    "o-",
                    ms=3.5,
                    lw=1.2,
                    color=colour,
                    label=words,
                )
        axis.plot(number, own, "o-", ms=5, lw=2.2, color=METHOD, label="RF-GS")
        label = "match within 10 cm (F10)"
        axis.set(xlabel="frame", ylabel=label, ylim=(0, 1.02), xticks=number)
        axis.grid(axis="y", color=INK, alpha=0.25, lw=0.6)
        # Above, in a column: a narrow page shows the left end of a chart first.
        figure.legend(loc="outside upper left", fontsize=8.5)
        return figure_uri(figure)
