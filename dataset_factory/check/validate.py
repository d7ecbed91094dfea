# SPDX-License-Identifier: Apache-2.0
"""Checks every promise a dataset makes; each fault names its file."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from tqdm import tqdm

from dataset_factory.check.labels import label_faults, mask_faults
from dataset_factory.check.paths import path_faults
from dataset_factory.check.physics import channel_faults, energy_faults
from dataset_factory.scene.bundle import unknown_joints
from rfgs_core.dataset import Sequence
from rfgs_core.dataset.csi_store import chunk_file
from rfgs_core.dataset.impaired_store import has_impaired, impaired_chunk
from rfgs_core.dataset.schema import read_dataset_info
from rfgs_core.dataset.writer import MANIFEST, listed_files, own_digest
from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.files import read_json, sha256
from rfgs_core.links import described, strange_entries
from rfgs_core.radio import layout

#: Larger manifests name more files than any dataset has [bytes].
_LARGEST_MANIFEST = 2**27
#: Coordinates of a store that follow from the devices in `sequence.json`.
LAYOUT_COORDINATES = (
    *("tx_xyz", "rx_xyz", "measured", "tx_device", "rx_device", "rx_column"),
    *("tx_quat_wxyz", "rx_quat_wxyz"),
)


def checksum_faults(path: Path) -> list[str]:
    """Faults of `dataset.json` and the manifest, and symbolic links; finds any change of a byte."""
    file = path / "dataset.json"
    faults = [*_link_faults(path), *_caught(lambda: _info_faults(file))]
    if not any(fault.startswith(f"{file}:") for fault in faults):
        manifest = read_dataset_info(file).manifest_sha256
        faults += _caught(lambda: _manifest_faults(path, manifest))
    return faults


def validate(path: Path) -> list[str]:
    """Checks schema, checksums, counts, numbers, markers, physics and labels.

    Args:
        path: Folder of the dataset.

    Returns:
        One line per fault, empty for a sound dataset.

    Raises:
        RfgsError: There is no dataset at all.
    """
    file = path / "dataset.json"
    if not file.is_file():
        raise RfgsError(f"{path}: no dataset there; expected a folder with dataset.json")
    faults = checksum_faults(path)
    if any(fault.startswith(f"{file}:") for fault in faults):
        return faults
    info = read_dataset_info(file)
    for name in info.sequences:
        faults += _caught(lambda name=name: _sequence_faults(Sequence(path / name, name), info.has))
    return list(dict.fromkeys(faults))


def _link_faults(path: Path) -> Iterator[str]:
    for entry in sorted(strange_entries(path)):
        yield f"{entry}: {described(entry)}; expected files and folders"


def _caught(check: Callable[[], Iterator[str] | list[str]]) -> list[str]:
    """Faults of a check; what a reader refuses is a fault too, and ends only that check."""
    found: list[str] = []
    try:
        found.extend(check())
    except RfgsError as error:
        found.append(str(error))
    return found


def _info_faults(file: Path) -> Iterator[str]:
    read_dataset_info(file)
    value = read_json(file)
    if value.get("sha256") != own_digest(value):
        yield f"{file}: content differs from the digest it holds"
    elif file.read_text("utf-8") != json.dumps(value, indent=1, sort_keys=True) + "\n":
        yield f"{file}: altered after it was written"
    elif not value["manifest_sha256"]:
        yield f"{file}: unfinished; run the same rfgs-factory generate again"


def _manifest_faults(path: Path, manifest_sha256: str) -> Iterator[str]:
    file = path / MANIFEST
    if not file.is_file():
        yield f"{file}: missing"
        return
    if file.stat().st_size > _LARGEST_MANIFEST:
        yield f"{file}: larger than a list of files is"
        return
    if sha256(file) != manifest_sha256:
        yield f"{file}: differs from the digest in dataset.json"
        return
    try:
        lines = file.read_text("utf-8").splitlines()
    except UnicodeDecodeError as error:
        raise RfgsFormatError(f"{file}: expected a digest and a name per line ({error})") from error
    promised = {name: digest for digest, _, name in (line.partition("  ") for line in lines)}
    present = set(listed_files(path))
    yield from (f"{path / name}: not in the manifest" for name in sorted(present - set(promised)))
    for name, digest in tqdm(promised.items(), desc="checksums", unit="file"):
        if name not in present:
            yield f"{path / name}: missing"
        elif not (path / name).is_symlink() and sha256(path / name) != digest:
            yield f"{path / name}: altered (checksum differs from the manifest)"


def _sequence_faults(sequence: Sequence, has: list[str]) -> Iterator[str]:
    with tqdm(sequence.radios, desc="channels", unit="radio") as bar:
        for radio in bar:
            yield from _caught(
                lambda radio=radio: _radio_faults(sequence, radio, "geometry" in has)
            )
            if "paths" in has:
                yield from _caught(lambda radio=radio: path_faults(sequence, radio))
    if "geometry" in has:
        yield from _caught(lambda: _geometry_faults(sequence))
    if "images" in has:
        for frame in tqdm(sequence.frames, desc="pictures", unit="frame"):
            yield from _caught(lambda frame=frame: _picture_faults(sequence, frame, has))
        for camera in sequence.cameras:
            yield from _caught(lambda name=camera["name"]: _empty_faults(sequence, name))


def _radio_faults(sequence: Sequence, radio: str, traced: bool) -> Iterator[str]:
    """Faults of one radio; levels and delays of captures are their radios' own, not physics."""
    store = sequence.files.csi(radio)
    data, spec, devices = (
        sequence.radio(radio),
        sequence.radio_spec(radio),
        sequence.devices(radio),
    )
    times_s = [sequence.sample_times_s(radio, frame) for frame in sequence.frames]
    if data["frame"].values.tolist() != np.repeat(sequence.frames, len(times_s[0])).tolist():
        yield f"{store}: frame: expected the frames of sequence.json, once per sample"
    elif not np.allclose(data["time_s"].values, np.concatenate(times_s), rtol=0.0, atol=1e-9):
        yield f"{store}: time_s: differs from frames and samples in sequence.json"
    if not np.allclose(data["freq_hz"].values, spec.freq_hz, rtol=1e-12):
        yield f"{store}: freq_hz: differs from the radio in sequence.json"
    for name in LAYOUT_COORDINATES:
        if name not in data:
            yield f"{store}: {name}: missing; the dataset was made by an older version"
            continue
        values, samples = data[name].values, 1
        if "time" in data[name].dims:
            samples = len(times_s[0])
            values = values.reshape(-1, samples, *values.shape[1:])
        places = (layout(spec, devices, sample) for sample in range(samples))
        expected = np.stack([getattr(place, name) for place in places])
        if not (np.isfinite(values).all() and np.allclose(values, expected, atol=1e-9)):
            yield f"{store}: {name}: differs from the devices in sequence.json"
    static = sequence.csi_static_samples(radio)
    yield from _static_faults(sequence, radio, static) if traced else ()
    for index, frame in enumerate(sequence.frames):
        file = chunk_file(store, index)
        yield from _caught(
            lambda frame=frame, file=file: _frame_faults(
                sequence, radio, frame, file, static, traced
            )
        )
    if has_impaired(store):
        yield from _caught(lambda: _impaired_faults(sequence, radio))


def _static_faults(sequence: Sequence, radio: str, static: np.ndarray) -> Iterator[str]:
    """What the static channel of a traced scene says against physics."""
    file = chunk_file(sequence.files.csi(radio), None)
    yield from channel_faults(sequence, radio, static, file)
    yield from energy_faults(sequence, radio, static, f"{file}: static")


def _frame_faults(
    sequence: Sequence, radio: str, frame: int, file: Path, static: np.ndarray, traced: bool
) -> Iterator[str]:
    value = sequence.csi_samples(radio, frame)
    measured = sequence.layout(radio).measured
    if not np.isfinite(value).all():
        yield f"{file}: frame {frame}: values that are not finite"
    elif value[:, ~measured].any():
        yield f"{file}: frame {frame}: values on links that are not measured"
    elif not np.abs(value[:, measured]).any(axis=(1, 2)).all():
        yield f"{file}: frame {frame}: silent channel"
    elif not traced:
        return
    elif _nobody(sequence, radio, value, static):
        hint = (
            "" if sequence.trace_depth(radio) > 2 else "; behind a wall only --depth 3 shows people"
        )
        yield f"{file}: frame {frame}: equals the static channel, nobody is in it{hint}"
    else:
        yield from energy_faults(sequence, radio, value, f"{file}: frame {frame}")


def _nobody(sequence: Sequence, radio: str, value: np.ndarray, static: np.ndarray) -> bool:
    """Whether a sample equals the static channel; of antennas that move, whether all do."""
    same = (value == static).all(axis=(1, 2, 3))
    # Furniture may hide people from some of the places.
    return bool(same.all() if sequence.radio_spec(radio).antennas_move else same.any())


def _impaired_faults(sequence: Sequence, radio: str) -> Iterator[str]:
    """Impaired channels are missing exactly where a packet is lost, and zero where no link is."""
    layout, known = sequence.layout(radio), sequence.impairments(radio)
    store = sequence.files.csi(radio)
    lost = ~known.draw.packet_received[:, layout.tx_device[:, None], layout.rx_device]
    count = len(lost) // len(sequence.frames)
    if not np.isfinite(known.gain_db).all():
        yield f"{store / 'gain_db'}: gains that are not finite"
    for index, frame in enumerate(sequence.frames):
        value = sequence.csi_samples(radio, frame, impaired=True)
        file = impaired_chunk(store, index)
        missing = lost[index * count : (index + 1) * count] & layout.measured
        if not np.array_equal(np.isnan(value), np.broadcast_to(missing[..., None], value.shape)):
            yield f"{file}: frame {frame}: missing values do not match the lost packets"
        elif value[:, ~layout.measured].any():
            yield f"{file}: frame {frame}: values on links that are not measured"


def _geometry_faults(sequence: Sequence) -> Iterator[str]:
    vertices, _ = sequence.static_mesh()
    if not np.isfinite(vertices).all():
        yield f"{sequence.files.static_mesh}: positions that are not finite"
    low, high = sequence.bounds_m[0] - 0.01, sequence.bounds_m[1] + 0.01
    ids = {row["id"] for row in sequence.instances}
    for frame in sequence.frames:
        file = sequence.files.geometry(frame)
        moving, faces, instance = sequence.moving_mesh(frame)
        if faces.size and not 0 <= faces.min() <= faces.max() < len(moving):
            yield f"{file}: does not fit {sequence.files.topology.name}"
        joints = sequence.joints(frame)
        known = joints[~unknown_joints(joints)]
        if not (np.isfinite(moving).all() and np.isfinite(known).all()):
            yield f"{file}: positions that are not finite"
        elif (moving < low).any() or (moving > high).any():
            yield f"{file}: vertices outside the bounds of sequence.json"
        if not set(np.unique(instance).tolist()) <= ids:
            yield f"{sequence.files.topology}: instance ids missing in sequence.json"
        yield from label_faults(sequence, frame)


def _picture_faults(sequence: Sequence, frame: int, has: list[str]) -> Iterator[str]:
    files = sequence.files
    if not files.images_done(frame).is_file():
        yield f"{files.images_done(frame)}: no marker, these pictures were never finished"
    ids = {0, *(row["id"] for row in sequence.instances)}
    for camera in sequence.cameras:
        name, shape = camera["name"], (camera["height"], camera["width"])
        planes = {
            files.image(name, frame): sequence.image(name, frame),
            files.depth(name, frame): sequence.depth(name, frame),
            files.normal(name, frame): sequence.normal(name, frame),
            files.mask(name, frame): sequence.mask(name, frame),
        }
        for file, plane in planes.items():
            if plane.shape[:2] != shape:
                yield f"{file}: expected {shape[1]} x {shape[0]} px, got {plane.shape[:2]}"
        depth = planes[files.depth(name, frame)]
        if np.isnan(depth).any() or (depth <= 0).any():
            yield f"{files.depth(name, frame)}: depths that are not positive"
        if not np.isfinite(planes[files.normal(name, frame)]).all():
            yield f"{files.normal(name, frame)}: normals that are not finite"
        unknown = set(np.unique(planes[files.mask(name, frame)]).tolist()) - ids
        if unknown:
            yield f"{files.mask(name, frame)}: ids {sorted(unknown)} missing in sequence.json"
        elif "geometry" in has and depth.shape == planes[files.mask(name, frame)].shape == shape:
            yield from mask_faults(sequence, frame, name)


def _empty_faults(sequence: Sequence, camera: str) -> Iterator[str]:
    row = next(row for row in sequence.cameras if row["name"] == camera)
    shape = sequence.image_empty(camera).shape[:2]
    if shape != (row["height"], row["width"]):
        yield f"{sequence.files.image_empty(camera)}: expected the camera's size, got {shape}"
