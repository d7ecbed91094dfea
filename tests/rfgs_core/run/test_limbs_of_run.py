# SPDX-License-Identifier: Apache-2.0
"""A run whose people have limbs: where Gaussians start, what is kept, what is refused."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from scipy.spatial import KDTree

from rfgs_core.articulated import BONES, Pose, facets_of, people
from rfgs_core.bodies.body_prior import Bodies
from rfgs_core.bodies.tracks import Tracks
from rfgs_core.cli.pose import PoseArgs
from rfgs_core.cli.pose import run as pose
from rfgs_core.dataset import open_dataset
from rfgs_core.errors import RfgsFormatError
from rfgs_core.files import read_json
from rfgs_core.limbs import weights
from rfgs_core.limbs.evidence.library import headings_of
from rfgs_core.limbs.evidence.tell import Told
from rfgs_core.limbs.network import LimbNetwork
from rfgs_core.limbs.postures.tell import Told as Posture
from rfgs_core.limbs.propose import Joints
from rfgs_core.limbs.weights import save_network
from rfgs_core.measure.observations import Observations
from rfgs_core.pose import estimate_poses, score_poses
from rfgs_core.radio.presets import preset
from rfgs_core.report.limbs import limbs_of
from rfgs_core.run import Run
from rfgs_core.run import find_limbs as limbs_of_run
from rfgs_core.run.find_limbs import frames_read
from rfgs_core.run.folder import LIMBS_FILE
from rfgs_core.run.limbs import read_limbs
from rfgs_core.run.training import train_sequence
from rfgs_core.settings import TrainConfig

CONFIG = TrainConfig(num_gaussians=400, solver_steps=2, iterations=0, posture="standing")


def saying(low_m: float, sigma_m: float, tall: float = 1.0) -> LimbNetwork:
    """A network that says a standing body, so much too low and so tall, whatever it hears."""
    torch.manual_seed(5)
    made = LimbNetwork(4)
    body = people().body(np.zeros(0))
    upright = tall * body.joints17(Pose(body.heads[0], body.neutral)) - [0.0, 0.0, 0.95 + low_m]
    with torch.no_grad():
        last = made.say[-1]
        assert isinstance(last, torch.nn.Linear)
        last.weight *= 0.02
        said = np.concatenate([upright / 0.3, np.full((17, 1), np.log(sigma_m))], axis=1)
        last.bias[:] = torch.from_numpy(said.ravel()).float()
    return made


def stays(places: np.ndarray, _: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The course of somebody who goes nowhere."""
    return np.zeros(len(places)), np.zeros(len(places))


@pytest.fixture
def network(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of a network for the tiny dataset's radio, and for no other."""
    folder = tmp_path / "networks"
    folder.mkdir()
    save_network(folder / "wifi.safetensors", saying(0.0, 0.05), preset("wifi"), {})
    monkeypatch.setattr(weights, "OWN", folder)
    return folder


@pytest.fixture
def limbed(network: Path, train: Callable[..., Run], tiny_dataset: Path, tmp_path: Path) -> Run:
    return train(tiny_dataset, tmp_path / "run", CONFIG)


def test_gaussians_start_on_the_skin_and_stay_at_their_place(limbed: Run) -> None:
    limbs = read_limbs(limbed.path)
    assert limbs is not None and limbs.frames == [1, 2]
    body = limbs.people.body(0)
    for index, frame in enumerate(limbs.frames):
        skin = body.skin(limbs.people.pose(index, 0))
        centres = facets_of(skin, body.faces)[0]
        gaps = KDTree(centres).query(limbed.moving(frame).means.numpy())[0]
        assert gaps.max() < 0.06
    tracks = [limbed.attributes(frame)["track_id"] for frame in (1, 2)]
    np.testing.assert_array_equal(tracks[0], tracks[1])
    told = limbed.attributes(2)
    head = told["bone"] == BONES.index("head")
    height_m = limbed.moving(2).means.numpy()[:, 2]
    assert head.any() and height_m[head].min() > 1.3
    np.testing.assert_allclose(told["sigma_m"], 0.05, rtol=0.3)


def test_a_training_that_was_interrupted_ends_in_the_same_bytes(
    limbed: Run, train: Callable[..., Run], tiny_dataset: Path
) -> None:
    names = [LIMBS_FILE, "gaussians/000001.ply", "gaussians/000002.ply", "checkpoints/000002.npz"]
    before = {name: (limbed.path / name).read_bytes() for name in names}
    for gone in names[2:]:
        (limbed.path / gone).unlink()
    train(tiny_dataset, limbed.path, CONFIG)
    assert {name: (limbed.path / name).read_bytes() for name in names} == before
    # Limbs alone too: Gaussians on skins need them.
    for more in (names[3:], []):
        for gone in (LIMBS_FILE, *more):
            (limbed.path / gone).unlink()
        train(tiny_dataset, limbed.path, CONFIG)
        assert {name: (limbed.path / name).read_bytes() for name in names} == before


@pytest.mark.parametrize(
    "changes", [{"limbs": "off"}, {"observe": "power"}, {"density": "motion"}, {"recipe": "paper"}]
)
def test_some_settings_do_without_limbs(
    changes: dict, network: Path, train, tiny_dataset: Path, tmp_path: Path
) -> None:
    run = train(tiny_dataset, tmp_path / "plain", replace(CONFIG, **changes))
    assert read_limbs(run.path) is None


@pytest.mark.parametrize(
    ("low_m", "sigma_m", "told"), [(0.0, 0.2, False), (0.6, 0.2, True), (0.6, 0.6, False)]
)
def test_unsure_limbs_are_of_use_where_nobody_stands(
    low_m: float, sigma_m: float, told: bool, network: Path, train, tiny_dataset, tmp_path: Path
) -> None:
    """More than 0.15 m off, but further from a standing body than that: better than it."""
    save_network(network / "wifi.safetensors", saying(low_m, sigma_m), preset("wifi"), {})
    limbs = read_limbs(train(tiny_dataset, tmp_path / "unsure", CONFIG).path)
    assert (limbs is not None) is told


@pytest.mark.parametrize(("sigma_m", "of_use"), [(0.14, True), (0.29, True), (0.31, False)])
def test_of_who_lies_limbs_are_of_use_though_less_sure(sigma_m: float, of_use: bool) -> None:
    """Joints of the prior of who lies are much further off than those of who stands."""
    where = np.zeros((1, 2))
    lies = Bodies(where, np.array([np.nan]), np.array([[0.3, 0.13]]))
    tracks = [Tracks.begun(where, float(time)).laid(lies) for time in range(2)]
    joints = Joints(np.zeros((2, 1, 17, 3)), np.full((2, 1, 17), sigma_m))
    assert limbs_of_run._of_use(joints, [[], []], tracks) == of_use


def test_a_single_unsure_frame_is_compared_with_standing_too(
    network: Path, train, tiny_dataset: Path, tmp_path: Path
) -> None:
    save_network(network / "wifi.safetensors", saying(0.6, 0.2), preset("wifi"), {})
    run = train(tiny_dataset, tmp_path / "one", CONFIG, frames=[1])
    assert read_limbs(run.path) is not None


def test_without_a_network_for_the_radio_there_are_no_limbs(
    network: Path, train, tiny_dataset: Path, tmp_path: Path
) -> None:
    save_network(network / "wifi.safetensors", LimbNetwork(49), preset("mmwave"), {})
    assert read_limbs(train(tiny_dataset, tmp_path / "plain", CONFIG).path) is None


@pytest.mark.parametrize("told", [True, False])
def test_without_a_network_evidence_tells_who_walks(
    told: bool, train, tiny_dataset: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[int] = []

    def tell(seen: list, axes_xy: np.ndarray, seed: int, on_frame: Callable) -> Told | None:
        asked.append(len(seen))
        body = people().body(np.zeros(0))
        upright = body.joints17(Pose(body.heads[0], body.neutral))
        xyz = upright + np.column_stack([axes_xy, np.zeros(len(axes_xy))])[:, None, None]
        return Told(Joints(xyz, np.full((len(seen), 1, 17), 0.06)), 5.0, 1.0) if told else None

    monkeypatch.setattr(weights, "OWN", tmp_path / "none")
    monkeypatch.setattr(limbs_of_run, "long_enough", lambda time_s: True)
    monkeypatch.setattr(limbs_of_run, "tell", tell)
    monkeypatch.setattr(limbs_of_run, "tell_posture", lambda *_: None)
    monkeypatch.setattr(limbs_of_run, "course_of", stays)
    limbs = read_limbs(train(tiny_dataset, tmp_path / "run", CONFIG).path)
    assert asked and asked[0] >= 2
    assert (limbs is not None) == told
    # What came of it is in the frames: nobody is asked again about a run that is finished.
    asked.clear()
    train(tiny_dataset, tmp_path / "run", CONFIG)
    assert not asked
    if limbs is not None:
        pelvis = limbs.people.joints17()[:, 0, 0, :2]
        found = np.array([track.axes_xy[0] for track in limbs.tracks])
        assert np.abs(pelvis - found).max() < 0.1


@pytest.mark.parametrize("told", [True, False])
def test_who_does_not_walk_may_do_something_else(
    told: bool, train, tiny_dataset: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    body, asked = people().body(np.zeros(0)), 0
    upright = body.joints17(Pose(body.heads[0], body.neutral))

    def tell_posture(
        seen: list, axes_xy: np.ndarray, seed: int, on_frame: Callable
    ) -> Posture | None:
        nonlocal asked
        asked += 1
        xyz = upright + np.column_stack([axes_xy, np.full(len(axes_xy), -0.4)])[:, None, None]
        return Posture(Joints(xyz, np.full((len(seen), 1, 17), 0.07)), 90.0) if told else None

    monkeypatch.setattr(weights, "OWN", tmp_path / "none")
    monkeypatch.setattr(limbs_of_run, "long_enough", lambda time_s: True)
    monkeypatch.setattr(limbs_of_run, "tell", lambda *_: None)
    monkeypatch.setattr(limbs_of_run, "can_tell", lambda _: True)
    monkeypatch.setattr(limbs_of_run, "tell_posture", tell_posture)
    monkeypatch.setattr(limbs_of_run, "course_of", stays)
    limbs = read_limbs(train(tiny_dataset, tmp_path / "run", CONFIG).path)
    assert asked == 1 and (limbs is not None) == told
    if limbs is not None:
        pelvis = limbs.people.joints17()[:, 0, 0, 2]
        np.testing.assert_allclose(pelvis, upright[0, 2] - 0.4, atol=0.05)
    # Where too few devices hear each other nobody is asked.
    monkeypatch.setattr(limbs_of_run, "can_tell", lambda _: False)
    assert read_limbs(train(tiny_dataset, tmp_path / "few", CONFIG).path) is None
    assert asked == 1


@pytest.mark.parametrize(("apart_m", "together"), [(0.04, True), (0.3, False)])
def test_evidence_and_a_network_count_together_if_they_agree(
    apart_m: float, together: bool, network: Path, train, tiny_dataset: Path, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    """A walk is that of a mean body, and the network tells how tall the person is."""
    save_network(network / "wifi.safetensors", saying(0.0, 0.05, 0.93), preset("wifi"), {})
    alone = read_limbs(train(tiny_dataset, tmp_path / "alone", CONFIG).path)
    assert alone is not None
    tall = alone.people.body(0).height_m / people().body(np.zeros(0)).height_m
    assert abs(tall - 1.0) > 0.02, "the case is too easy"
    ground = alone.joints.xyz[:, :, :1].copy()
    ground[..., 2] = open_dataset(tiny_dataset).sequence().bounds_m[0, 2]
    aside = ground + (alone.joints.xyz - ground) / tall + np.array([apart_m, 0.0, 0.0])
    sigma = np.full((2, 1, 17), 0.06)

    def tell(*_: object) -> Told:
        return Told(Joints(aside, sigma), 5.0, 1.0)

    monkeypatch.setattr(limbs_of_run, "long_enough", lambda time_s: True)
    monkeypatch.setattr(limbs_of_run, "tell", tell)
    both = read_limbs(train(tiny_dataset, tmp_path / "both", CONFIG).path)
    assert both is not None
    share = sigma**-2.0 / (sigma**-2.0 + alone.joints.sigma_m**-2.0) if together else 0.0
    moved = both.joints.xyz - alone.joints.xyz
    np.testing.assert_allclose(moved[..., 0], apart_m * share, atol=1e-6)
    surer = both.joints.sigma_m < np.minimum(0.06, alone.joints.sigma_m)
    assert surer.all() if together else not surer.any()


def test_of_two_people_one_walks_and_the_other_stands(
    tiny_dataset: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each is asked for without the echoes of the other; a network would tell the second."""
    heard: list[np.ndarray] = []
    body = people().body(np.zeros(0))
    neutral = body.joints17(Pose(body.heads[0], body.neutral))

    def tell(seen: list, axes_xy: np.ndarray, *_: object) -> Told | None:
        heard.append(np.array([one.delta for one in seen]))
        if len(heard) > 1:
            return None
        xyz = neutral + np.column_stack([axes_xy, np.zeros(len(axes_xy))])[:, None, None]
        return Told(Joints(xyz, np.full((len(seen), 1, 17), 0.06)), 5.0, 1.0)

    monkeypatch.setattr(weights, "OWN", tmp_path / "none")
    monkeypatch.setattr(limbs_of_run, "long_enough", lambda time_s: True)
    monkeypatch.setattr(limbs_of_run, "tell", tell)
    monkeypatch.setattr(limbs_of_run, "can_tell", lambda _: True)
    monkeypatch.setattr(limbs_of_run, "tell_posture", lambda *_: pytest.fail("of two people"))
    data, out = open_dataset(tiny_dataset), tmp_path / "run"
    train_sequence(data, data.sequence(), "wifi", [1, 2], CONFIG, out, people=2)
    limbs = read_limbs(out)
    assert limbs is not None and len(heard) == 2
    assert np.abs(heard[0] - heard[1]).max() > 0.0
    assert (limbs.joints.sigma_m[:, 0] == 0.06).all() and (limbs.joints.sigma_m[:, 1] > 0.1).all()
    standing = limbs.joints.xyz[:, 1] - limbs.joints.xyz[:, 1, :1]
    # It stands upright where it was found, whichever way it faces.
    np.testing.assert_allclose(
        standing[..., 2], np.broadcast_to(neutral[:, 2] - neutral[0, 2], (2, 17)), atol=1e-9
    )
    found = np.array([track.axes_xy[1] for track in limbs.tracks])
    assert np.linalg.norm(limbs.joints.xyz[:, 1, 0, :2] - found, axis=1).max() < 0.1


@pytest.mark.parametrize("speed_m_s", [1.0, 0.1])
def test_of_whom_nothing_is_told_stands_facing_the_way_if_everybody_goes(
    speed_m_s: float, train, tiny_dataset: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def course(places: np.ndarray, _: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return np.full(len(places), 2.0), np.full(len(places), speed_m_s)

    monkeypatch.setattr(weights, "OWN", tmp_path / "none")
    monkeypatch.setattr(limbs_of_run, "long_enough", lambda time_s: True)
    monkeypatch.setattr(limbs_of_run, "tell", lambda *_: None)
    monkeypatch.setattr(limbs_of_run, "can_tell", lambda _: False)
    monkeypatch.setattr(limbs_of_run, "course_of", course)
    limbs = read_limbs(train(tiny_dataset, tmp_path / "run", CONFIG).path)
    assert (limbs is not None) == (speed_m_s > 0.5)
    if limbs is not None:
        np.testing.assert_allclose(np.cos(headings_of(limbs.joints.xyz[:, 0]) - 2.0), 1.0)
        found = np.array([track.axes_xy[0] for track in limbs.tracks])
        assert np.linalg.norm(limbs.joints.xyz[:, 0, 0, :2] - found, axis=1).max() < 0.1
        assert (limbs.joints.sigma_m > 0.1).all()


def test_two_frames_are_too_short_a_walk_for_evidence(
    train, tiny_dataset: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(weights, "OWN", tmp_path / "none")
    monkeypatch.setattr(limbs_of_run, "tell", lambda *_: pytest.fail("it was asked"))
    assert read_limbs(train(tiny_dataset, tmp_path / "run", CONFIG).path) is None


def test_frames_between_those_of_the_run_are_read_too(limbed: Run) -> None:
    one = Run(limbed.path, replace(limbed.config, frames=[1]))
    near = open_dataset(limbed.path / limbed.config.dataset).sequence()
    apart_s = abs(near.time_s(2) - near.time_s(1))
    assert frames_read(one) == ([1, 2] if apart_s <= 0.4 else [1])


def test_frames_beside_the_run_in_which_nobody_is_heard_are_left_out(limbed: Run) -> None:
    """People come and go: who asks for frames with somebody in them does not ask for the others."""

    class Before:
        """A run whose other frames are those of the empty room."""

        frames, path, config, sequence = [1], limbed.path, limbed.config, limbed.sequence

        def observations(self, frame: int) -> Observations:
            seen = limbed.observations(frame)
            return seen if frame == 1 else seen.with_delta(np.zeros_like(seen.delta))

    settings = limbed.config.settings
    frames, seen, tracks, alone = limbs_of_run._read(Before(), [1, 2], settings, lambda: None)  # type: ignore[arg-type]
    assert frames == [1] and len(seen) == len(tracks) == len(alone) == 1
    both = limbs_of_run._read(limbed, [1, 2], settings, lambda: None)[0]
    assert both == [1, 2]


def test_reports_say_which_joints_are_seen(limbed: Run, small_run: Run) -> None:
    section = limbs_of(limbed)
    assert section is not None and limbs_of(small_run) is None
    assert section.chart.uri.startswith("data:image/png;base64,")
    scores = score_poses(estimate_poses(limbed), limbed.sequence)
    table = {row.label: [cell.text for cell in row.cells] for row in section.table.rows}
    wrists = [scores["fit"]["joints_m"][f"{side}_wrist"] for side in ("left", "right")]
    assert table["wrists"][2] == f"{np.mean(wrists):.3f}"
    share = 100.0 * np.mean([scores["joints_seen"][f"{side}_knee"] for side in ("left", "right")])
    assert table["knees"][0] == f"{share:.0f}"
    assert f"{scores['fit']['mpjpe_m']:.3f} m off on average" in section.sentences[0]


def test_poses_come_from_the_limbs(limbed: Run, capsys: pytest.CaptureFixture[str]) -> None:
    assert pose(PoseArgs(limbed.path)) == 0
    assert re.search(r"(?m)^height +[\d.]+ m; by the true limbs [\d.]+ m$", capsys.readouterr().out)
    limbs = read_limbs(limbed.path)
    assert limbs is not None
    with np.load(limbed.path / "pose.npz") as stored:
        np.testing.assert_allclose(stored["joints"], limbs.people.joints17())
        assert stored["sigma_m"].shape == (2, 1, 17)
    assert read_json(limbed.path / "pose.json")["fit"]["mpjpe_m"] > 0.0
    assert (limbed.path / "person0.bvh").read_text().startswith("HIERARCHY")


def test_a_damaged_file_is_named(limbed: Run) -> None:
    (limbed.path / LIMBS_FILE).write_bytes(b"PK\x03\x04 nothing")
    with pytest.raises(RfgsFormatError, match=rf"{LIMBS_FILE}.*run the same `rfgs train` again"):
        read_limbs(limbed.path)
