# SPDX-License-Identifier: Apache-2.0
"""Self-calibration of runs: injected offsets are found, kept, and taken out of the fit."""

from __future__ import annotations

import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import zarr

from rfgs_core.bodies.localise import locate_bodies, pair_maps
from rfgs_core.cli import main
from rfgs_core.dataset import open_dataset
from rfgs_core.dataset.csi_store import digest
from rfgs_core.dataset.names import SequenceFiles
from rfgs_core.errors import RfgsError
from rfgs_core.evaluate.geometry import geometry_metrics
from rfgs_core.evaluate.provenance import conditions
from rfgs_core.evaluate.scene import Scene
from rfgs_core.files import write_json
from rfgs_core.fit.calibrate import Calibration
from rfgs_core.fit.frame import explained_change, solved_frame
from rfgs_core.measure.offsets import CrossSpectra, Offsets, estimate_offsets
from rfgs_core.run import Run, open_run
from rfgs_core.run.calibration import read_calibration
from rfgs_core.settings import TrainConfig

CAPTURE = Offsets(np.array([0.0, 2.5, -1.2, 0.7]), np.array([0.0, 4e-9, -7e-9, 5e-9]))
DRIFT = {
    1: Offsets(np.array([0.0, -0.4, 3.0, 0.2]), np.array([0.0, 2e-9, 1e-9, -3e-9])),
    2: Offsets(np.array([0.0, 1.4, -2.0, 0.9]), np.array([0.0, -1e-9, 2e-9, 1e-9])),
}


def inject(dataset: Path) -> Path:
    """Turns every channel of the tiny dataset as devices with offsets do."""
    sequence = open_dataset(dataset).sequence()
    files, elements = SequenceFiles(dataset / "tiny"), sequence.layout("wifi")
    freq_hz = sequence.radio_spec("wifi").freq_hz
    own = CAPTURE.turn(elements, freq_hz)
    values: dict[int | None, np.ndarray] = {None: sequence.csi_static("wifi") * own}
    for frame, drift in DRIFT.items():
        values[frame] = sequence.csi("wifi", frame) * own * drift.turn(elements, freq_hz)
    for frame, value in values.items():
        name = "csi_static" if frame is None else "csi"
        array = zarr.open_array(str(files.csi("wifi") / name), mode="r+")
        stored = value.astype(np.complex64)
        array[... if frame is None else frame - 1] = stored
        write_json(files.csi_done("wifi", frame), {"sha256": digest(stored)})
    return dataset


@pytest.fixture(scope="module")
def calibrated(
    tiny_dataset: Path, tmp_path_factory: pytest.TempPathFactory, train, quick_config
) -> Run:
    """A run on the tiny dataset with offsets, calibrated; copy it before changing anything."""
    root = tmp_path_factory.mktemp("calibrated")
    dataset = inject(Path(shutil.copytree(tiny_dataset, root / "dataset")))
    return train(dataset, root / "run", enough(quick_config))


def enough(config: TrainConfig) -> TrainConfig:
    """As many Gaussians as it takes to tell offsets by them."""
    return replace(config, calibrate="both", num_gaussians=400, solver_steps=8)


def copy_of(run: Run, name: str) -> Run:
    """The run again, beside its dataset."""
    return open_run(Path(shutil.copytree(run.path, run.path.parent / name)))


def test_injected_offsets_are_found_and_kept(calibrated: Run) -> None:
    """Drift: the ball changes what stands still by a percent. Capture: the room has direct paths
    only, which outweigh the Gaussians' error of the model: heard from one side, they stand for a
    ball heard through."""
    for frame, drift in DRIFT.items():
        found = read_calibration(calibrated.path, frame)
        for got, true, degrees, seconds in (
            (found.capture, CAPTURE, 1.0, 20e-12),
            (found.drift, drift, 1.0, 80e-12),
        ):
            wrong = np.angle(np.exp(1j * (got.phase_rad - true.phase_rad)))
            assert np.abs(np.rad2deg(wrong)).max() < degrees
            assert np.abs(got.delay_s - true.delay_s).max() < seconds
    first, second = (read_calibration(calibrated.path, frame) for frame in (1, 2))
    np.testing.assert_array_equal(first.capture.phase_rad, second.capture.phase_rad)


def test_resuming_gives_the_same_bytes(calibrated: Run, train, quick_config) -> None:
    run = copy_of(calibrated, "resumed")
    names = ["calibration/000002.npz", "checkpoints/000002.npz", "gaussians/000002.ply"]
    before = {name: (run.path / name).read_bytes() for name in names}
    for name in names:
        (run.path / name).unlink()
    again = train(run.path.parent / "dataset", run.path, enough(quick_config))
    assert {name: (again.path / name).read_bytes() for name in names} == before


def test_predictions_are_those_of_devices_with_the_captures_offsets(calibrated: Run) -> None:
    elements = calibrated.sequence.layout("wifi")
    turn = CAPTURE.turn(elements, calibrated.sequence.radio_spec("wifi").freq_hz)
    settings = replace(calibrated.config.settings, calibrate="none")
    plain = replace(calibrated, config=replace(calibrated.config, settings=settings))
    own = elements.tx_device[:, None] == elements.rx_device
    np.testing.assert_allclose(calibrated.predict(1)[own], plain.predict(1)[own], rtol=1e-4)
    between = calibrated.predict(1)[~own] * np.conj(turn[~own])
    assert np.abs(between).max() > 0
    # Without the offsets' turn the shadows are on the wrong phase.
    assert not np.allclose(between, plain.predict(1)[~own], rtol=0.1)


def test_a_calibrated_run_is_tried_on_what_its_own_fit_sees(calibrated: Run) -> None:
    """The drift of a frame is no change, and both sides have the offsets of the capture."""
    seen = calibrated.observations(1)
    visible = seen.links[..., None] & seen.subcarriers
    change = calibrated.visible_change(1, seen)
    np.testing.assert_array_equal(np.isfinite(change), visible)
    turn = read_calibration(calibrated.path, 1).capture.turn(seen.layout, seen.freq_hz)
    np.testing.assert_allclose(change[visible], (seen.delta * turn)[visible], rtol=1e-4)
    drifting = calibrated.as_reported(1).delta
    assert np.linalg.norm((drifting - change)[visible]) > np.linalg.norm(change[visible])
    said = calibrated.refitted(1, seen)[visible]
    alike = np.vdot(said, change[visible]).real
    assert alike > 0.5 * np.linalg.norm(said) * np.linalg.norm(change[visible])


def test_echoes_alone_tell_offsets_too(calibrated: Run, quick_config: TrainConfig) -> None:
    """Fitted to a channel without offsets, Gaussians find none; heard from one side, they stand
    for a ball heard through, and that error of the model is 5 % of 1/B = 6.25 ns."""
    config = enough(quick_config)
    seen = Calibration(CAPTURE, DRIFT[1]).undone(calibrated.as_reported(1))
    change = explained_change(seen, solved_frame(seen, config, 0))
    shape = np.vdot(change, seen.delta) / np.linalg.norm(change) / np.linalg.norm(seen.delta)
    assert 0.75 < abs(shape) < 1 - 1e-6
    assert not change[~seen.links].any() and not change[..., ~seen.subcarriers].any()
    found = estimate_offsets(CrossSpectra.of(seen, seen.delta, change), pooled=True)
    assert np.rad2deg(np.abs(found.phase_rad)).max() < 6.0
    assert np.abs(found.delay_s).max() < 310e-12


def test_the_offsets_stand_among_the_conditions(calibrated: Run, trained_run: Run) -> None:
    text = conditions(Scene.of(calibrated))["calibration"]
    found = re.match(r"against device 0, device 1: ([-\d.]+)°, ([-\d.]+) ns, device 2: ", text)
    assert found is not None
    assert float(found[1]) == pytest.approx(np.rad2deg(2.5), abs=1)
    assert float(found[2]) == pytest.approx(4.0, abs=0.02)
    assert "frames differ from the empty room by up to" in text
    assert conditions(Scene.of(trained_run))["calibration"] == "none"


def test_a_run_without_its_calibration_is_refused(calibrated: Run) -> None:
    run = copy_of(calibrated, "incomplete")
    (run.path / "calibration/000001.npz").unlink()
    with pytest.raises(RfgsError, match=r"calibration/000001\.npz: no such file; delete what"):
        run.predict(1)


def test_the_command_takes_it(tiny_dataset: Path, tmp_path: Path, capsys) -> None:
    out = tmp_path / "run"
    few = ["--gaussians", "30", "--iterations", "1", "--no-shader", "--frames", "1"]
    few += ["--posture", "standing"]
    arguments = ["train", str(tiny_dataset), "--radio", "wifi", "--out", str(out), *few]
    assert main([*arguments, "--calibrate", "timing"]) == 0
    found = read_calibration(out, 1)
    assert not found.capture.phase_rad.any() and found.capture.delay_s[1:].any()
    capsys.readouterr()
    assert main([*arguments, "--calibrate", "both"]) == 2
    assert "holds a run with another calibrate" in capsys.readouterr().err


def test_what_cannot_be_calibrated_leaves_nothing_behind(
    tiny_dataset: Path, train, quick_config, tmp_path: Path
) -> None:
    config = replace(quick_config, calibrate="both", observe="power")
    with pytest.raises(RfgsError, match="expected the phases that --observe complex reports"):
        train(tiny_dataset, tmp_path / "run", config)
    assert not (tmp_path / "run").exists()


def off_by_map(run: Run, scene: Scene, frame: int) -> float:
    """How far the peak of a frame's map is from where the ball is, seen from above [m]."""
    seen = run.observations(frame)
    place = locate_bodies(pair_maps(seen), seen.bounds_m, 1)[0]
    return float(np.linalg.norm(place - scene.reference(frame).mean(axis=0)[:2]))


@pytest.mark.slow
def test_a_calibrated_fit_stands_where_the_clean_one_does(
    tiny_dataset: Path, tmp_path: Path, train, quick_config
) -> None:
    """F10 of the clean, the calibrated and the uncalibrated fit of the same ball."""
    turned = inject(Path(shutil.copytree(tiny_dataset, tmp_path / "turned")))
    plain = replace(quick_config, num_gaussians=1500, solver_steps=8, iterations=20)
    runs = {
        "clean": train(tiny_dataset, tmp_path / "clean", plain, settled=True),
        "uncalibrated": train(turned, tmp_path / "uncalibrated", plain, settled=True),
        "calibrated": train(
            turned, tmp_path / "calibrated", replace(plain, calibrate="both"), settled=True
        ),
    }
    score = {}
    for name, run in runs.items():
        scene = Scene.of(run)
        rows = [
            geometry_metrics(scene.score(f), scene.grid, scene.reference(f), scene.voxels)
            for f in (1, 2)
        ]
        values = [
            [row["f10"], row["centroid_m"], off_by_map(run, scene, f)]
            for f, row in zip((1, 2), rows, strict=True)
        ]
        score[name] = np.mean(np.array(values, dtype=float), axis=0)
    assert score["calibrated"][0] > score["clean"][0] - 0.05, score
    assert score["uncalibrated"][0] < score["clean"][0] - 0.1, score
    # Offsets draw a map's peak aside; evidence judges each device pair by itself.
    assert score["uncalibrated"][2] > score["calibrated"][2] + 0.1, score
    assert score["uncalibrated"][1] < score["uncalibrated"][2] - 0.1, score
    assert score["calibrated"][1] < score["clean"][1] + 0.02, score
