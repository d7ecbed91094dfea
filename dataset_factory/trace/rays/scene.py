# SPDX-License-Identifier: Apache-2.0
"""A scene bundle as a Sionna RT scene: materials, meshes and one-element devices."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import sionna.rt as rt
from sionna.rt.radio_materials.itu import itu_material

from dataset_factory.scene.bundle import Bundle
from rfgs_core.radio import Layout, Radio
from rfgs_core.radio.constants import VACUUM_PERMITTIVITY
from rfgs_core.radio.layout import DevicePose, rotation
from rfgs_core.radio.sites import centres, owners
from rfgs_core.radio.tissue import normal_reflection, skin_conductivity, skin_permittivity
from rfgs_core.simulate.surface.movers import Movers

#: Transmitting and receiving sites that are traced together.
Group = tuple[np.ndarray, np.ndarray]
#: Name of the one object that holds everything that moves and scatters from points.
BODY = "moving"


def radio_material(row: dict[str, Any], index: int) -> rt.RadioMaterial:
    """The Sionna material of one row of a bundle's material table."""
    name = f"material-{index}"
    common: dict[str, Any] = {
        "thickness": float(row["thickness_m"]),
        "scattering_coefficient": float(row["scattering_coefficient"]),
    }
    if row["radio_material"] == "skin":
        return rt.RadioMaterial(name=name, frequency_update_callback=_skin, **common)
    return rt.ITURadioMaterial(name=name, itu_type=row["radio_material"], **common)


def half_space_reflection(name: str, freq_hz: np.ndarray) -> np.ndarray:
    """Normal reflection of a thick body of a radio material, complex128, shape of `freq_hz`."""
    if name == "skin":
        return normal_reflection(skin_permittivity(freq_hz))
    model: Any = itu_material
    values = [model(name, float(f)) for f in freq_hz]
    epsilon = np.array([float(np.ravel(np.array(e))[0]) for e, _ in values])
    sigma = np.array([float(np.ravel(np.array(s))[0]) for _, s in values])
    loss = sigma / (2.0 * np.pi * np.asarray(freq_hz) * VACUUM_PERMITTIVITY)
    return normal_reflection(epsilon - 1j * loss)


def _skin(freq_hz: mi.Float) -> tuple[mi.Float, mi.Float]:
    """Relative permittivity and conductivity [S/m] of skin for Sionna."""
    freq = np.array(freq_hz, dtype=np.float64).ravel()[:1]
    return (
        mi.Float(float(skin_permittivity(freq)[0].real)),
        mi.Float(float(skin_conductivity(freq)[0])),
    )


def mesh(name: str, vertices: np.ndarray, faces: np.ndarray) -> mi.Mesh:
    """A Mitsuba mesh with face normals from world vertices [m] and triangles."""
    props = mi.Properties()
    props["face_normals"] = True
    result = mi.Mesh(name, len(vertices), len(faces), props=props)
    params = mi.traverse(result)
    params["vertex_positions"] = mi.Float(np.ascontiguousarray(vertices, dtype=np.float32).ravel())
    params["faces"] = mi.UInt32(np.ascontiguousarray(faces, dtype=np.uint32).ravel())
    params.update()
    return result


def environment_scene(bundle: Bundle, radio: Radio, vehicles: Movers | None = None) -> rt.Scene:
    """Builds the scene without people, shapes kept apart.

    Args:
        bundle: Scene bundle.
        radio: Gives antenna pattern, polarisation and the frequency, its band's centre.
        vehicles: Rigid metal, put in its rest pose until `move_vehicles`; None for none.
    """
    scene = rt.load_scene(None)
    set_frequency(scene, radio.centre_hz)
    antenna = rt.PlanarArray(
        num_rows=1, num_cols=1, pattern=radio.pattern, polarization=radio.polarization
    )
    scene.tx_array = scene.rx_array = antenna
    parts = [
        (static_name(index), part.material_index, part.vertices, part.faces)
        for index, part in enumerate(bundle.static_meshes())
    ]
    if vehicles is not None:
        parts += [
            (name, material, vehicles.rest_vertices, faces)
            for name, material, faces in vehicle_meshes(vehicles)
        ]
    materials: dict[int, rt.RadioMaterial] = {}
    objects = []
    for name, index, vertices, faces in parts:
        if index not in materials:
            materials[index] = radio_material(bundle.materials[index], index)
        objects.append(
            rt.SceneObject(
                mi_mesh=mesh(name, vertices, faces), name=name, radio_material=materials[index]
            )
        )
    if objects:
        scene.edit(add=objects)
    return scene


def move_vehicles(scene: rt.Scene, vehicles: Movers, vertices: np.ndarray) -> None:
    """Puts vehicles where they are at a frame, in place.

    Args:
        scene: From `environment_scene` with these vehicles.
        vehicles: The vehicles.
        vertices: Their vertices [m], shape (V, 3).
    """
    names = [name for name, _, _ in vehicle_meshes(vehicles)]
    move_meshes(scene, dict.fromkeys(names, vertices))


def move_meshes(scene: rt.Scene, places: dict[str, np.ndarray]) -> None:
    """Sets the vertices [m], shape (V, 3), of meshes by name, in place."""
    params = scene.mi_scene_params
    for name, vertices in places.items():
        flat = np.ascontiguousarray(vertices, dtype=np.float32).ravel()
        params[f"{name}.vertex_positions"] = mi.Float(flat)
    params.update()


def static_name(index: int) -> str:
    """Name of a static mesh in the scene, by its place in the bundle's list."""
    return f"static-{index}"


def vehicle_meshes(vehicles: Movers) -> list[tuple[str, int, np.ndarray]]:
    """Name in the scene, material and triangles of each mesh of vehicles.

    There is one per material; all of them share the vertices of all vehicles.
    """
    found = [int(index) for index in np.unique(vehicles.material)]
    return [
        (f"vehicle-{index}", index, vehicles.faces[vehicles.material == index]) for index in found
    ]


def set_frequency(scene: rt.Scene, freq_hz: float) -> None:
    """Sets the carrier [Hz] as an opaque value, so that kernels do not depend on it."""
    scene.frequency = dr.opaque(mi.Float, freq_hz)


def add_antennas(
    scene: rt.Scene, layout: Layout, devices: list[DevicePose], group: Group | None = None
) -> None:
    """Adds sites as one-element transmitters and receivers, in order; those of a group, or all.

    What stood there before goes.
    """
    for name in [*scene.transmitters, *scene.receivers]:
        scene.remove(name)
    tx_centres, rx_centres = centres(layout)
    tx_owner, rx_owner = owners(layout)
    tx, rx = group or (np.arange(len(tx_owner)), np.arange(len(rx_owner)))
    for index in tx:
        orientation = mi.Point3f(*euler_angles(devices[tx_owner[index]].quat_wxyz))
        position = tx_centres[index].tolist()
        scene.add(rt.Transmitter(f"tx-{index}", position=position, orientation=orientation))
    for index in rx:
        orientation = mi.Point3f(*euler_angles(devices[rx_owner[index]].quat_wxyz))
        position = rx_centres[index].tolist()
        scene.add(rt.Receiver(f"rx-{index}", position=position, orientation=orientation))


def euler_angles(quat_wxyz: tuple[float, float, float, float]) -> tuple[float, float, float]:
    """Sionna's angles (α, β, γ) about z, y, x [rad] of a rotation world_from_device."""
    r = rotation(quat_wxyz)
    beta = float(np.arcsin(np.clip(-r[2, 0], -1.0, 1.0)))
    if abs(r[2, 0]) > 1.0 - 1e-12:
        return float(np.arctan2(-r[0, 1], r[1, 1])), beta, 0.0
    return float(np.arctan2(r[1, 0], r[0, 0])), beta, float(np.arctan2(r[2, 1], r[2, 2]))


def visible(mi_scene: Any, origins: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Whether nothing stands between points and one place, or a place each.

    Args:
        mi_scene: Mitsuba scene to test in.
        origins: Starting points [m], shape (point, 3).
        target: End point [m], shape (3,) or (point, 3).

    Returns:
        True where the segment is free, bool, shape (point,).
    """
    way = target - origins
    length = np.linalg.norm(way, axis=1)
    way = way / length[:, None]
    o = origins.astype(np.float32)
    d = way.astype(np.float32)
    # Stop short of the end, where float32 could meet a surface that the antenna hangs on.
    ray: Any = mi.Ray3f(mi.Point3f(*o.T), mi.Vector3f(*d.T))
    ray.maxt = mi.Float((length * (1.0 - 1e-5)).astype(np.float32))
    return ~np.array(mi_scene.ray_test(ray)).astype(bool)
