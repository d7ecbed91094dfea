# SPDX-License-Identifier: Apache-2.0
"""One sequence of a dataset: channels, pictures and geometry, checked when read."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Complex64, Float32, Float64, Int32, UInt8, UInt16

from rfgs_core.dataset.csi_store import open_csi, read_csi
from rfgs_core.dataset.geometry_store import (
    read_geometry,
    read_segment_velocity,
    read_topology,
)
from rfgs_core.dataset.impaired_store import Impaired, read_draw, read_impaired
from rfgs_core.dataset.mesh_ply import read_mesh
from rfgs_core.dataset.names import SequenceFiles
from rfgs_core.dataset.path_store import read_paths
from rfgs_core.dataset.pictures import read_planes, read_png_rgba, read_png_u16
from rfgs_core.dataset.schema import (
    bounds_array,
    check_size,
    device_pose,
    radio_from_json,
    read_sequence_info,
)
from rfgs_core.dataset.splits import refuse_beyond
from rfgs_core.dataset.store_schema import store_sizes
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.radio import DevicePose, Layout, Radio, frame_samples, layout
from rfgs_core.radio.path_table import PathTable

if TYPE_CHECKING:
    import xarray


class Sequence:
    """One scene over some frames, seen by radios and cameras."""

    def __init__(self, path: Path, name: str) -> None:
        self.path = path
        self.name = name
        self.files = SequenceFiles(path)
        self.info = read_sequence_info(self.files.info)
        self._coordinates: dict[str, xarray.Dataset] = {}

    @property
    def frames(self) -> list[int]:
        """Blender frame numbers, ascending."""
        return list(self.info.frames)

    @property
    def fps(self) -> float:
        """Frames per second."""
        return float(self.info.fps)

    @property
    def bounds_m(self) -> Float64[np.ndarray, "2 3"]:
        """Minimum and maximum of the scene [m]."""
        return bounds_array(self.info)

    @property
    def cameras(self) -> list[dict[str, Any]]:
        """Name, intrinsics, pose and split of each camera."""
        return self.info.cameras

    @property
    def splits(self) -> dict[str, Any]:
        """What is held out of training."""
        return self.info.splits

    def held_out(self, radio: str) -> dict[str, Any]:
        """What is held out of a radio's training, as `splits.radio_split` chooses it.

        Raises:
            RfgsError: There is no such radio.
            RfgsFormatError: It names elements, subcarriers or devices that the radio has not.
        """
        split = self.splits["rf"][self._radio(radio)]
        refuse_beyond(f"{self.files.info}: splits.rf.{radio}", split, self._sizes(radio))
        return split

    @property
    def instances(self) -> list[dict[str, Any]]:
        """Ids that masks and meshes use."""
        return self.info.instances

    @property
    def radios(self) -> list[str]:
        """Names of the radios."""
        return sorted(self.info.radios)

    def trace_depth(self, radio: str) -> int:
        """Interactions of a radio's path that meets a person, that one included."""
        return min(self.info.trace_depth, self.radio_spec(radio).deepest)

    def time_s(self, frame: int) -> float:
        """Time of a frame [s]."""
        return (frame - self.info.frame_start) / self.fps

    def sample_times_s(self, name: str, frame: int) -> Float64[np.ndarray, "sample"]:
        """Time of each of a radio's samples of a frame [s]; the first is the frame's own."""
        self._index(frame)
        return self.time_s(frame) + frame_samples(self.radio_spec(name), self.fps).offset_s

    def radio_spec(self, name: str) -> Radio:
        """The radio's band and antennas."""
        return radio_from_json(self.files.info, self.info.radios[self._radio(name)])

    def devices(self, name: str) -> list[DevicePose]:
        """Where the radio's devices stand; of one that moves, its place at each sample."""
        devices = [device_pose(row) for row in self.info.devices[self._radio(name)]]
        spec = self.radio_spec(name)
        if spec.antennas_move and len(devices) != spec.samples_per_frame:
            raise RfgsFormatError(
                f"{self.files.info}: devices of {name}: expected one place for each of "
                f"{spec.samples_per_frame} samples, got {len(devices)}"
            )
        return devices

    def layout(self, name: str, sample: int = 0) -> Layout:
        """Every antenna element of the radio, at one of a frame's samples where they move."""
        spec, devices = self.radio_spec(name), self.devices(name)
        check_size(self.files.info, spec, 1 if spec.antennas_move else len(devices))
        return layout(spec, devices, sample)

    def radio(self, name: str) -> xarray.Dataset:
        """Channels of a radio with their coordinates, read when used.

        Values read this way are not checked against their digests; `Sequence.csi` does that.
        """
        return open_csi(self.files.csi(self._radio(name)), self._sizes(name))

    def coordinates(self, name: str) -> xarray.Dataset:
        """Coordinates of a radio's channels alone; read once, as they are the same at all frames.

        Opening a store takes longer than reading a frame of a small radio. Do not change them.
        """
        if name not in self._coordinates:
            self._coordinates[name] = self.radio(name).coords.to_dataset()
        return self._coordinates[name]

    def csi(
        self, name: str, frame: int, *, impaired: bool = False
    ) -> Complex64[np.ndarray, "tx rx subcarrier"]:
        """Channel at a frame's own time, checked against the digest stored with it.

        Args:
            name: Which radio.
            frame: Which frame.
            impaired: What imperfect radios report, NaN where a packet is lost.

        Raises:
            RfgsError: There is no such radio or frame, or nothing was impaired.
            RfgsFormatError: The chunk is missing, truncated or altered.
        """
        return self.csi_samples(name, frame, impaired=impaired)[0]

    def csi_samples(
        self, name: str, frame: int, *, impaired: bool = False
    ) -> Complex64[np.ndarray, "sample tx rx subcarrier"]:
        """Channels of all samples of a frame (packets, chirps, pulses), checked like `csi`.

        Raises:
            RfgsError: There is no such radio or frame, or nothing was impaired.
            RfgsFormatError: The chunk is missing, truncated or altered.
        """
        index, store = self._index(frame), self.files.csi(self._radio(name))
        links, counts = self._links(name), (self.radio_spec(name).samples_per_frame,)
        if impaired:
            return read_impaired(store, index, links, counts)
        return read_csi(store, index, self.files.csi_done(name, frame), links, counts)

    def impairments(self, name: str) -> Impaired:
        """How the impaired channels came about: settings, draws and gains.

        Raises:
            RfgsError: There is no such radio, or nothing was impaired.
            RfgsFormatError: What is stored is damaged.
        """
        return read_draw(self.files.csi(self._radio(name)), self._sizes(name))

    def csi_static(self, name: str) -> Complex64[np.ndarray, "tx rx subcarrier"]:
        """Channel without anything that moves, checked against its digest.

        Raises:
            RfgsFormatError: The chunk is missing, truncated or altered.
        """
        return self.csi_static_samples(name)[0]

    def csi_static_samples(self, name: str) -> Complex64[np.ndarray, "sample tx rx subcarrier"]:
        """Channel without anything that moves at each sample of a frame.

        There is a single one, for all samples, unless the antennas move within a frame.

        Raises:
            RfgsFormatError: The chunk is missing, truncated or altered.
        """
        store, done = self.files.csi(self._radio(name)), self.files.csi_done(name, None)
        counts = (1, self.radio_spec(name).samples_per_frame)
        return read_csi(store, None, done, self._links(name), counts)

    def paths(self, name: str, frame: int) -> PathTable:
        """The paths behind `csi` of a frame, between centres of sites.

        Raises:
            RfgsError: There is no such radio or frame, or the dataset holds no paths.
            RfgsFormatError: The table is damaged.
        """
        self._index(frame)
        return read_paths(self.files.paths(self._radio(name), frame))

    def paths_static(self, name: str) -> PathTable:
        """The paths behind `csi_static`, refused like `paths`."""
        return read_paths(self.files.paths(self._radio(name), None))

    def moving_mesh(
        self, frame: int
    ) -> tuple[
        Float32[np.ndarray, "vertex 3"],
        Int32[np.ndarray, "face 3"],
        Int32[np.ndarray, "face"],
    ]:
        """Vertices [m], triangles and instance id per triangle of what moves."""
        topology = read_topology(self.files.topology)
        vertices = self._geometry(frame)["vertices"]
        faces = topology["faces"]
        if faces.size and not 0 <= faces.min() <= faces.max() < len(vertices):
            raise RfgsFormatError(f"{self.files.topology}: expected triangles of existing vertices")
        return vertices, faces, topology["instance"]

    def static_mesh(self) -> tuple[Float32[np.ndarray, "vertex 3"], Int32[np.ndarray, "face 3"]]:
        """Vertices [m] and triangles of what stands still."""
        return read_mesh(self.files.static_mesh)

    def joints(self, frame: int) -> Float32[np.ndarray, "person 17 3"]:
        """Joint positions of each person [m], in the order of `rfgs_core.skeleton`.

        All NaN for a person whose joints the scene does not tell.
        """
        return self._geometry(frame)["joints"]

    def segment_velocity(self, frame: int) -> Float32[np.ndarray, "person 17 3"]:
        """Velocity of the centre of each body segment's skin [m/s], segments as `joints`.

        A segment is the skin that follows a joint of `rfgs_core.skeleton` (`segment` of the
        topology); one without skin of its own has the velocity of the joint.
        """
        self._index(frame)
        return read_segment_velocity(self.files.geometry(frame))

    def people(self, frame: int) -> Int32[np.ndarray, "person"]:
        """Instance id of each person, in the order of `joints`."""
        return self._geometry(frame)["person_instance"]

    def actions(self, frame: int) -> list[str]:
        """What each person does, in the order of `joints`; empty where that is not known."""
        return [str(action) for action in self._geometry(frame)["action"]]

    def image(self, camera: str, frame: int) -> UInt8[np.ndarray, "h w 4"]:
        """Colour picture, sRGB with alpha."""
        self._index(frame)
        return read_png_rgba(self.files.image(self._camera(camera), frame))

    def image_empty(self, camera: str) -> UInt8[np.ndarray, "h w 4"]:
        """Colour picture without anything that moves."""
        return read_png_rgba(self.files.image_empty(self._camera(camera)))

    def depth(self, camera: str, frame: int) -> Float32[np.ndarray, "h w"]:
        """Planar depth [m], +inf where nothing was hit."""
        self._index(frame)
        return read_planes(self.files.depth(self._camera(camera), frame), "Z")[0]

    def normal(self, camera: str, frame: int) -> Float32[np.ndarray, "h w 3"]:
        """World normals, zero where nothing was hit."""
        self._index(frame)
        return np.stack(read_planes(self.files.normal(self._camera(camera), frame), "XYZ"), axis=-1)

    def mask(self, camera: str, frame: int) -> UInt16[np.ndarray, "h w"]:
        """Instance id of each pixel, 0 for everything static."""
        self._index(frame)
        return read_png_u16(self.files.mask(self._camera(camera), frame))

    def _index(self, frame: int) -> int:
        try:
            return self.info.frames.index(frame)
        except ValueError as error:
            raise RfgsError(
                f"{self.path}: no frame {frame}; it holds {self.frames[0]} to {self.frames[-1]}, "
                f"{len(self.frames)} frames"
            ) from error

    def _radio(self, name: str) -> str:
        if name not in self.info.radios:
            raise RfgsError(f"{self.path}: no radio {name!r}; it holds {', '.join(self.radios)}")
        return name

    def _camera(self, name: str) -> str:
        names = [row["name"] for row in self.cameras]
        if name not in names:
            raise RfgsError(f"{self.path}: no camera {name!r}; it holds {', '.join(names)}")
        return name

    def _links(self, name: str) -> tuple[int, int, int]:
        """Transmitting and receiving elements of a radio, and its subcarriers."""
        tx, rx = self.layout(self._radio(name)).measured.shape
        return tx, rx, self.radio_spec(name).num_subcarriers

    def _sizes(self, name: str) -> dict[str, int]:
        """How long the dimensions of a radio's store are."""
        return store_sizes(len(self.frames), self.radio_spec(name), self.layout(name))

    def _geometry(self, frame: int) -> dict[str, np.ndarray]:
        self._index(frame)
        return read_geometry(self.files.geometry(frame))
