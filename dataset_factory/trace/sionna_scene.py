# SPDX-License-Identifier: Apache-2.0
"""A scene bundle as a scene of Sionna RT, for programs that trace on their own."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from dataset_factory.scene.bundle import Bundle, read_bundle
from dataset_factory.scene.devices import choose_devices
from dataset_factory.scene.radios import SCENE_RADIO, chosen_radios, scene_radio
from dataset_factory.trace.setup import prepare
from rfgs_core.errors import RfgsError
from rfgs_core.radio import layout

if TYPE_CHECKING:
    import sionna.rt as rt


def sionna_scene(bundle: Path | str, radio: str, frame: int | None = None) -> rt.Scene:
    """A bundle as a scene of Sionna RT: its meshes with their radio materials, and its devices.

    Each site, that is antenna elements near enough to share rays, is a transmitter `tx-N` or a
    receiver `rx-N` of one antenna with the radio's pattern and polarisation. Sionna RT has no
    model of people: here they are bodies of skin that reflect as walls do.

    Args:
        bundle: Folder that `python -m addon_rfgs --blend FILE export --out FOLDER` wrote.
        radio: A preset, a file that describes a radio, or `scene`; its centre is the carrier.
        frame: Frame that moving things are posed at; None leaves them out.

    Returns:
        The scene, ready for `sionna.rt.PathSolver`.

    Raises:
        RfgsError: The folder is no bundle, or has no such frame; or the radio is not known.

    Example:
        scene = sionna_scene("my_bundle", "wifi", frame=20)
        paths = sionna.rt.PathSolver()(scene, max_depth=3)
    """
    prepare()
    from dataset_factory.trace.rays.scene import add_antennas, environment_scene

    found = read_bundle(Path(bundle))
    if frame is not None and frame not in found.frames:
        there = f"{found.frames[0]} to {found.frames[-1]}"
        raise RfgsError(f"{bundle}: no frame {frame}; it has {len(found.frames)}, {there}")
    if radio == SCENE_RADIO:
        spec = scene_radio(found)
    else:
        (spec,) = chosen_radios((radio,)).values()
    devices, _ = choose_devices(found, spec)
    scene = environment_scene(found, spec)
    if frame is not None:
        _add_movers(scene, found, frame)
    add_antennas(scene, layout(spec, devices), devices)
    return scene


def _add_movers(scene: rt.Scene, bundle: Bundle, frame: int) -> None:
    """Adds everything that moves as it is at a frame, an object for each material."""
    import sionna.rt as rt

    from dataset_factory.trace.rays.scene import mesh, radio_material

    topology, vertices = bundle.topology, bundle.frame(frame).vertices
    objects = []
    for index in map(int, np.unique(topology.material)):
        row, name = bundle.materials[index], f"moving-{index}"
        faces = topology.faces[topology.material == index]
        material = scene.radio_materials.get(f"material-{index}") or radio_material(row, index)
        body = mesh(name, vertices, faces)
        objects.append(rt.SceneObject(mi_mesh=body, name=name, radio_material=material))
    if objects:
        scene.edit(add=objects)
