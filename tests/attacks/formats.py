# SPDX-License-Identifier: Apache-2.0
"""Every format that is read, a sound file of it, and what is read out of that file."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mutations
import numpy as np
from mutations import Mutation
from tiny_dataset import write_tiny_dataset

from dataset_factory.check.validate import checksum_faults
from dataset_factory.make.impair import impair_dataset
from dataset_factory.scene.overrides import SceneOptions, read_options
from rfgs_core.arrays import save_arrays
from rfgs_core.dataset import open_dataset
from rfgs_core.dataset.path_store import read_paths
from rfgs_core.dataset.schema import read_dataset_info
from rfgs_core.dataset.sequence import Sequence
from rfgs_core.dataset.writer import MANIFEST, finish_dataset, own_digest, write_arrays
from rfgs_core.encode.learned import load_encoder
from rfgs_core.encode.learned.encoder import EncoderModel, LearnedEncoder
from rfgs_core.encode.learned.signature import RadioSignature
from rfgs_core.encode.learned.store import save_encoder
from rfgs_core.files import sha256
from rfgs_core.radio import preset
from rfgs_core.radio.files import radio_text, radio_values, read_radio
from rfgs_core.radio.impairments import IMPAIRMENT_PRESETS, read_impairments
from rfgs_core.render.shader import HIDDEN, Shader
from rfgs_core.report.metrics_file import read_metrics
from rfgs_core.report.tables import metric_tables
from rfgs_core.run import Run, open_run
from rfgs_core.run.calibration import read_calibration
from rfgs_core.run.checkpoint import finished_frame
from rfgs_core.run.static import read_static_set
from rfgs_core.run.training import train_sequence
from rfgs_core.seals import write_sealed_json
from rfgs_core.settings import TrainConfig

#: Where a dataset of one frame keeps a table of paths.
PATHS = Path("tiny/radio/wifi/paths/000001.npz")


@dataclass(frozen=True)
class Format:
    """A kind of file under attack."""

    name: str
    file: Path
    mutate: Mutation
    read: Callable[[], Any]
    dataset: Path | None = None
    """The dataset that the file belongs to, whose checksums then find every change."""
    seal: Callable[[], None] | None = None
    """Makes the dataset's digests fit the changed file, as somebody who wants to harm would."""
    theirs: bool = False
    """Whether people, radios or other programs write it: another sound value is their choice."""


def digest(value: Any) -> str:
    """A digest of arrays, tensors, dataclasses and everything JSON knows."""
    text = hashlib.sha256()
    _feed(text, value)
    return text.hexdigest()


def _feed(text: Any, value: Any) -> None:
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        value = {spec.name: getattr(value, spec.name) for spec in dataclasses.fields(value)}
    if hasattr(value, "detach"):
        value = value.detach().numpy()
    if isinstance(value, np.ndarray):
        text.update(f"{value.dtype} {value.shape}".encode())
        text.update(np.ascontiguousarray(value).tobytes())
    elif isinstance(value, dict):
        for key in sorted(value, key=str):
            text.update(f"{key}:".encode("utf-8", "surrogatepass"))
            _feed(text, value[key])
    elif isinstance(value, list | tuple):
        text.update(f"[{len(value)}".encode())
        for item in value:
            _feed(text, item)
    else:
        text.update(f"{type(value).__name__} {value!r}".encode("utf-8", "surrogatepass"))


def make_all(folder: Path) -> list[Format]:
    """Writes sound files of all formats."""
    data = write_tiny_dataset(folder / "data")
    impair_dataset(data, IMPAIRMENT_PRESETS["commodity"])
    add_path_table(data)
    plain = Path(shutil.copytree(data, folder / "plain"))
    run = _trained(plain, folder / "run")
    return [*_dataset(data), *_run(run), *_inputs(folder)]


def _dataset(data: Path) -> list[Format]:
    store = data / "tiny/radio/wifi/csi.zarr"
    described = {
        "dataset.json": (data / "dataset.json", mutations.json_of),
        "sequence.json": (data / "tiny/sequence.json", mutations.json_of),
    }
    files: dict[str, tuple[Path, Mutation]] = {
        **described,
        "marker": (data / "tiny/radio/wifi/done/000001", mutations.json_of),
        "zarr.json of csi": (store / "csi/zarr.json", mutations.json_of),
        "zarr.json of freq_hz": (store / "freq_hz/zarr.json", mutations.json_of),
        "zarr.json of csi_impaired": (store / "csi_impaired/zarr.json", mutations.json_of),
        "zarr.json of the store": (store / "zarr.json", mutations.json_of),
        "chunk of csi": (store / "csi/c/0/0/0/0", mutations.bytes_of),
        "chunk of freq_hz": (store / "freq_hz/c/0", mutations.bytes_of),
        "geometry": (data / "tiny/geometry/000001.npz", mutations.arrays_of),
        "topology": (data / "tiny/geometry/topology.npz", mutations.arrays_of),
        "static.ply": (data / "tiny/geometry/static.ply", mutations.numbers_of),
        "image": (data / "tiny/images/cam00/000001.png", mutations.bytes_of),
        "mask": (data / "tiny/mask/cam00/000001.png", mutations.bytes_of),
        "depth": (data / "tiny/depth/cam00/000001.exr", mutations.bytes_of),
        "normal": (data / "tiny/normal/cam00/000001.exr", mutations.bytes_of),
    }
    made = [
        Format(name, file, mutate, lambda: _everything(data), data)
        for name, (file, mutate) in files.items()
    ]
    manifest, paths = data / MANIFEST, data / PATHS
    made.append(Format("paths", paths, mutations.arrays_of, lambda: read_paths(paths), data))

    def seal() -> None:
        info = json.loads((data / "dataset.json").read_text())
        info["manifest_sha256"] = sha256(manifest)
        info["sha256"] = own_digest(info)
        (data / "dataset.json").write_text(json.dumps(info, indent=1, sort_keys=True) + "\n")

    def faults() -> list[str]:
        found = checksum_faults(data)
        assert all("\n" not in fault for fault in found)
        return found

    return [
        *made,
        Format("manifest", manifest, mutations.text_of, faults, data),
        Format("sealed manifest", manifest, mutations.text_of, faults, data, seal),
    ]


def _everything(data: Path) -> Any:
    dataset = open_dataset(data)
    sequence: Sequence = dataset.sequence()
    frame, radio = sequence.frames[0], sequence.radios[0]
    stored = sequence.coordinates(radio)
    return [
        *(dataset.info, sequence.info, sequence.devices(radio), sequence.layout(radio)),
        *(sequence.held_out(radio), sequence.bounds_m, sequence.trace_depth(radio)),
        {name: stored[name].values for name in stored.coords},
        *(sequence.csi(radio, frame), sequence.csi_static(radio), sequence.impairments(radio)),
        sequence.csi(radio, frame, impaired=True),
        *(sequence.moving_mesh(frame), sequence.static_mesh(), sequence.joints(frame)),
        *(sequence.people(frame), sequence.actions(frame), sequence.segment_velocity(frame)),
        *(
            getattr(sequence, picture)(camera["name"], frame)
            for camera in sequence.cameras
            for picture in ("image", "depth", "normal", "mask")
        ),
    ]


def _trained(data: Path, out: Path) -> Path:
    dataset = open_dataset(data)
    config = TrainConfig(
        num_gaussians=40, solver_steps=2, iterations=1, posture="standing", calibrate="both",
        channel="impaired", static_set=20,
    )  # fmt: skip
    train_sequence(dataset, dataset.sequence(), "wifi", [1, 2], config, out)
    shape = {"W1": (HIDDEN, 32), "W2": (HIDDEN, HIDDEN), "W3": (3, HIDDEN)}
    save_arrays(out / "shader.npz", {name: np.ones(s, np.float32) for name, s in shape.items()})
    return out


def _run(path: Path) -> list[Format]:
    from whole_metrics import whole_metrics

    write_sealed_json(path / "metrics.json", whole_metrics())
    ply = path / "gaussians/000001.ply"

    def frame() -> Any:
        run: Run = open_run(path)
        return [run.attributes(1), run.moving(1), run.head, run.bodies(1), run.gaussians(1)]

    def described() -> Any:
        run = open_run(path)
        return [run.config, run.sequence.name, run.observations(run.frames[0])]

    def evaluated() -> Any:
        metrics = read_metrics(path)
        return [metrics, repr(metric_tables(metrics))]

    return [
        Format("config.json", path / "config.json", mutations.json_of, described),
        Format("metrics.json", path / "metrics.json", mutations.json_of, evaluated),
        Format("gaussians ply", ply, mutations.numbers_of, frame),
        Format("features", ply.with_suffix(".features.npz"), mutations.arrays_of, frame),
        Format("radio head", path / "radio_head.npz", mutations.arrays_of, frame),
        Format(
            "checkpoint", path / "checkpoints/000001.npz", mutations.arrays_of,
            lambda: finished_frame(open_run(path), 1),
        ),
        Format(
            "calibration", path / "calibration/000001.npz", mutations.arrays_of,
            lambda: read_calibration(path, 1),
        ),
        Format(
            "static head", path / "static_head.npz", mutations.arrays_of,
            lambda: read_static_set(path),
        ),
        Format(
            "shader", path / "shader.npz", mutations.arrays_of,
            lambda: Shader.load(path / "shader.npz"),
        ),
    ]  # fmt: skip


def _inputs(folder: Path) -> list[Format]:
    radio, encoder = preset("wifi"), folder / "encoder.npz"
    own = dataclasses.replace(radio, name="lab")
    (folder / "lab.yaml").write_text(radio_text(own))
    (folder / "lab.json").write_text(json.dumps(radio_values(own)))
    (folder / "worn.json").write_text(json.dumps(dataclasses.asdict(IMPAIRMENT_PRESETS["lab"])))
    (folder / "scene.yaml").write_text(
        "fps: 30\nunit_scale: 1.0\npeople: [A, B]\nroom: box\ncameras: {ring: 4}\n"
        "materials: {'Wall*': concrete, 'Glas*': glass}\nbounds_m: [[0, 0, 0], [1, 2, 3]]\n"
    )
    signature = RadioSignature(radio.freq_hz, np.zeros((1, 3)), np.zeros((64, 3)), 1, 0.0)
    save_encoder(encoder, LearnedEncoder("csi", EncoderModel("csi", 0), signature, "made here"))

    def weights() -> Any:
        made = load_encoder(encoder)
        return [made.kind, made.radio, dict(made.model.state_dict())]

    scene = folder / "scene.yaml"
    options = SceneOptions(scene_config=scene)
    lab = [folder / name for name in ("lab.yaml", "lab.json", "worn.json")]
    return [
        Format("radio yaml", lab[0], mutations.text_of, lambda: read_radio(lab[0]), theirs=True),
        Format("radio json", lab[1], mutations.json_of, lambda: read_radio(lab[1]), theirs=True),
        Format(
            "impairments",
            lab[2],
            mutations.json_of,
            lambda: read_impairments(str(lab[2])),
            theirs=True,
        ),
        Format(
            "scene yaml",
            folder / "scene.yaml",
            mutations.text_of,
            lambda: read_options(options),
            theirs=True,
        ),
        Format("encoder", encoder, mutations.arrays_of, weights),
    ]


def add_path_table(dataset: Path) -> Path:
    """Gives a dataset a table of three paths of two corners."""
    columns = {
        **dict.fromkeys(("tx_site", "rx_site", "tx_device", "rx_device"), np.zeros(3, np.int32)),
        "delay_s": np.arange(3.0) * 1e-9,
        **dict.fromkeys(
            (
                *("doppler_hz", "departure_zenith_rad", "departure_azimuth_rad"),
                *("arrival_zenith_rad", "arrival_azimuth_rad"),
            ),
            np.ones(3, np.float32),
        ),
        "amplitude": np.ones((3, 1, 2), np.complex64),
        "node_hz": np.array([5e9, 6e9]),
        "kind": np.ones((3, 2), np.uint8),
        "object": np.ones((3, 2), np.int32),
        "vertices": np.ones((3, 4, 3), np.float32),
    }
    write_arrays(dataset / PATHS, **columns)
    finish_dataset(dataset, read_dataset_info(dataset / "dataset.json"))
    return dataset / PATHS
