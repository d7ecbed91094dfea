# SPDX-License-Identifier: Apache-2.0
"""What a scene must satisfy before a radio is traced in it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Float64, Int

from rfgs_core.errors import RfgsError
from rfgs_core.radio.constants import SPEED_OF_LIGHT
from rfgs_core.radio.layout import NEAREST_ANTENNAS_M, DevicePose, layout, nearest_m
from rfgs_core.radio.materials import MATERIALS
from rfgs_core.radio.presets import PRESETS, Radio

#: Multiple reflections travel further than twice the diagonal; this much is added for them [m].
DELAY_MARGIN_M = 5.0

#: A closed mesh that fills more of the scene than this is the room itself, not furniture.
ROOM_FRACTION = 0.5

#: Lists hold meshes of different sizes, so these axes (with an underscore) are bound to none.
_Mesh = tuple[str, Float[np.ndarray, "_vertex 3"], Int[np.ndarray, "_face 3"]]


def check(
    radio: Radio, bounds_m: Float64[np.ndarray, "2 3"], materials: list[dict[str, Any]]
) -> list[str]:
    """Lists what keeps a radio from being traced faithfully in a scene.

    Args:
        radio: The radio.
        bounds_m: Minimum and maximum of the scene [m].
        materials: Rows with `name` and `radio_material`.

    Returns:
        One sentence per problem, each with its remedy; empty when all is well.
    """
    return too_far(radio, bounds_m) + material_problems(radio, materials)


def material_problems(radio: Radio, materials: list[dict[str, Any]]) -> list[str]:
    """Lists materials whose model does not cover a radio's band, one sentence each.

    Args:
        radio: The radio.
        materials: Rows with `name` and `radio_material`.
    """
    return [problem for row in materials if (problem := _material_problem(radio, row))]


def too_far(radio: Radio, bounds_m: Float64[np.ndarray, "2 3"]) -> list[str]:
    """Why a scene is too large for the spacing of a radio's subcarriers, with the remedy.

    Args:
        radio: The radio.
        bounds_m: Minimum and maximum of the scene [m].

    Returns:
        One sentence, or none where the scene is small enough.
    """
    longest_m = 2.0 * float(np.linalg.norm(bounds_m[1] - bounds_m[0])) + DELAY_MARGIN_M
    if radio.unambiguous_path_m >= longest_m:
        return []
    needed = math.ceil(radio.bandwidth_hz * longest_m / SPEED_OF_LIGHT)
    fitting = [name for name, other in PRESETS.items() if other.unambiguous_path_m >= longest_m]
    instead = [*fitting, f"a file with `like: {radio.name}` and `num_subcarriers: {needed}`"]
    return [
        f"radio {radio.name!r} tells paths apart only up to {radio.unambiguous_path_m:.1f} m "
        f"(c / subcarrier spacing), but paths in this scene reach {longest_m:.1f} m; use "
        f"{', '.join(instead)}, or smaller --bounds"
    ]


def too_deep(radio: Radio, depth: int) -> str:
    """Why a radio is not traced at a depth beyond its deepest, with the remedy."""
    why = "traced at one frequency, too few for an ultra-wide band"
    if radio.antennas_move:
        why = "not traced for antennas that move"
    return (
        f"radio {radio.name!r}, trace depth {depth}: people's paths by way of walls are {why}; "
        f"use --depth {radio.deepest}"
    )


def check_devices(
    radio: Radio,
    bounds_m: Float64[np.ndarray, "2 3"],
    devices: list[DevicePose],
    meshes: Iterable[_Mesh],
    room_m: Float64[np.ndarray, "2 3"] | None = None,
) -> list[str]:
    """Lists devices that are outside the scene, inside a closed object or inside each other.

    Args:
        radio: The radio the devices belong to.
        bounds_m: Minimum and maximum of the scene [m].
        devices: Their poses.
        meshes: Name, vertices [m] and triangles of each static object.
        room_m: Box of the room around the people [m], where it is known.

    Returns:
        One sentence per problem.
    """
    problems = []
    points = np.array([device.position_m for device in devices]).reshape(-1, 3)
    for device, point in zip(devices, points, strict=True):
        if (point < bounds_m[0]).any() or (point > bounds_m[1]).any():
            problems.append(
                f"device {device.name!r} of radio {radio.name!r} at {np.round(point, 2).tolist()} "
                "m is outside the scene; move it inside or enlarge the scene"
            )
        else:
            antennas = layout(radio, [device])
            for xyz in (antennas.tx_xyz, antennas.rx_xyz):
                outside = ((xyz < bounds_m[0]) | (xyz > bounds_m[1])).any(axis=1)
                if outside.any():
                    problems.append(
                        f"{np.count_nonzero(outside)} of {len(xyz)} antennas of device "
                        f"{device.name!r} of radio {radio.name!r} are outside the scene; move or "
                        "turn the device, or use a radio with a shorter array"
                    )
    problems += _coincident(radio, devices)
    room_m = bounds_m if room_m is None else room_m
    for name, vertices, faces in meshes:
        problems.extend(
            f"device {devices[index].name!r} of radio {radio.name!r} is inside {name!r}; move it "
            "out of the object"
            for index in np.flatnonzero(enclosed(points, room_m, vertices, faces))
        )
    return problems


def enclosed(
    points: Float64[np.ndarray, "point 3"],
    room_m: Float64[np.ndarray, "2 3"],
    vertices: Float[np.ndarray, "vertex 3"],
    faces: Int[np.ndarray, "face 3"],
) -> Bool[np.ndarray, "point"]:
    """Which points are inside a closed mesh; the room itself encloses none.

    Args:
        points: Places [m].
        room_m: Minimum and maximum of the room around the people, or of the scene [m].
        vertices: Vertices of the mesh [m].
        faces: Its triangles.
    """
    inside = np.zeros(len(points), dtype=bool)
    if not len(faces):
        return inside
    volume = float(np.prod(np.maximum(room_m[1] - room_m[0], 1e-6)))
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    if np.prod(high - low) > ROOM_FRACTION * volume:
        return inside
    near = np.flatnonzero(((points > low) & (points < high)).all(axis=1))
    inside[near] = np.abs(winding_number(points[near], vertices, faces)) > 0.5
    return inside


def _coincident(radio: Radio, devices: list[DevicePose]) -> list[str]:
    """Pairs of devices of which one sends from where the other hears."""
    antennas = layout(radio, devices)
    found: dict[tuple[int, int], str] = {}
    for tx, rx in antennas.device_pairs:
        places = (
            antennas.tx_xyz[antennas.tx_device == tx],
            antennas.rx_xyz[antennas.rx_device == rx],
        )
        pair = min(tx, rx), max(tx, rx)
        if tx != rx and pair not in found and nearest_m(*places) < NEAREST_ANTENNAS_M:
            found[pair] = (
                f"antennas of devices {devices[pair[0]].name!r} and {devices[pair[1]].name!r} of "
                f"radio {radio.name!r} are in the same place; move one"
            )
    return list(found.values())


def refuse_places(radio: Radio, devices: list[DevicePose]) -> None:
    """Refuses devices between which there is no channel.

    Raises:
        RfgsError: One sends from where another hears, or there is no link at all.
    """
    problems = _coincident(radio, devices)
    if problems:
        raise RfgsError(problems[0])
    if not devices or not layout(radio, devices).measured.any():
        raise RfgsError(
            f"radio {radio.name!r} has no link with {len(devices)} devices: they do not hear "
            "themselves; place two or more"
        )


def winding_number(
    points: Float[np.ndarray, "point 3"],
    vertices: Float[np.ndarray, "vertex 3"],
    faces: Int[np.ndarray, "face 3"],
) -> Float64[np.ndarray, "point"]:
    """How often a mesh wraps around each point: ±1 inside a closed one, 0 outside.

    Solid angle of a triangle after Van Oosterom and Strackee (1983), eq. 8:
    tan(Ω/2) = a·(b×c) / (abc + (a·b)c + (b·c)a + (c·a)b).
    """
    total = np.zeros(len(points))
    corners = vertices.astype(np.float64)[faces]
    for index, point in enumerate(points):
        a, b, c = np.moveaxis(corners - point, 1, 0)
        la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
        top = np.einsum("ij,ij->i", a, np.cross(b, c))
        bottom = la * lb * lc + (a * b).sum(1) * lc + (b * c).sum(1) * la + (c * a).sum(1) * lb
        total[index] = 2.0 * np.arctan2(top, bottom).sum() / (4.0 * np.pi)
    return total


def _material_problem(radio: Radio, row: dict[str, Any]) -> str:
    name = row["radio_material"]
    if name not in MATERIALS:
        return (
            f"material {row['name']!r} has the unknown radio material {name!r}; expected one of "
            f"{', '.join(sorted(MATERIALS))}"
        )
    material = MATERIALS[name]
    if material.covers(radio):
        return ""
    remedy = sorted(other.name for other in MATERIALS.values() if other.covers(radio))
    return (
        f"material {row['name']!r} is {name!r}, which is known from "
        f"{material.freq_min_hz / 1e9:g} to {material.freq_max_hz / 1e9:g} GHz only, but radio "
        f"{radio.name!r} uses {radio.freq_min_hz / 1e9:g} to {radio.freq_max_hz / 1e9:g} GHz; "
        f"choose one of {', '.join(remedy)}"
    )
