# SPDX-License-Identifier: Apache-2.0
"""A room that nobody recorded empty: its channel from the frames, and who moves in it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rfgs_core.background import learned as learned_background_module
from rfgs_core.background.learned import learned_background, without_movers
from rfgs_core.dataset import Sequence, open_dataset
from rfgs_core.errors import RfgsError
from rfgs_core.evaluate.scene import Scene
from rfgs_core.files import read_json
from rfgs_core.measure.kinds import KINDS, Visible
from rfgs_core.measure.observations import observe
from rfgs_core.run import open_run
from tests import tiny_dataset as tiny


def on_a_circle(frame: int) -> np.ndarray:
    """Centre of a sphere that walks once around, 0.7 m from the middle."""
    angle = 2 * np.pi * frame / 16
    return np.array([1.5 + 0.7 * np.cos(angle), 1.5 + 0.7 * np.sin(angle), 1.0])


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The tiny dataset over sixteen frames and one round."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tiny, "FRAMES", list(range(1, 17)))
        patch.setattr(tiny, "centre_m", on_a_circle)
        return tiny.write_tiny_dataset(tmp_path_factory.mktemp("walk") / "dataset")


@pytest.fixture
def no_capture(monkeypatch) -> None:
    """Nobody recorded the empty room."""

    def missing(_self: Sequence, name: str) -> np.ndarray:
        raise AssertionError(f"the empty-room capture of {name} was read")

    monkeypatch.setattr(Sequence, "csi_static", missing)


@pytest.mark.parametrize("kind", ["complex", "power", "delay_power", "csi_ratio", "conjugate"])
def test_the_median_is_closer_to_the_room_than_any_frame(walk: Path, kind) -> None:
    sequence = open_dataset(walk).sequence()
    background = learned_background(sequence, "wifi", "clean", kind)
    seen = observe(sequence, "wifi", 4)
    keep = seen.links[..., None] & (seen.subcarriers if kind != "delay_power" else True)

    def visible(csi: np.ndarray) -> np.ndarray:
        may = Visible(seen.links, seen.subcarriers, seen.layout, seen.freq_hz)
        return np.where(keep, KINDS[kind].report(np.where(seen.subcarriers, csi, 0), may), 0)

    room = visible(sequence.csi_static("wifi"))
    error = np.sum(np.abs(background - room) ** 2)
    changes = [np.sum(np.abs(visible(sequence.csi("wifi", f)) - room) ** 2) for f in range(1, 17)]
    assert error < 0.5 * min(changes)
    assert (background[~seen.links] == 0).all()


def test_still_entries_are_exact(walk: Path, monkeypatch) -> None:
    """Every frame the same but one: the median is the same again."""
    sequence = open_dataset(walk).sequence()
    room = sequence.csi_static("wifi")
    monkeypatch.setattr(
        *(Sequence, "csi_samples"),
        lambda self, name, frame, **_: room[None] * (2.0 if frame == 3 else 1.0),
    )
    seen = observe(sequence, "wifi", 4)
    got = learned_background(sequence, "wifi", "clean", "complex")
    keep = seen.links[..., None] & seen.subcarriers
    np.testing.assert_array_equal(got, np.where(keep, room, 0))


def test_who_moves_is_found_without_an_empty_room(
    walk: Path, train, quick_config, tmp_path: Path, no_capture, monkeypatch
) -> None:
    config = replace(quick_config, background="learned", num_gaussians=100)
    run = train(walk, tmp_path / "run", config, [2])
    centre = run.moving(2).means.mean(dim=0).numpy()
    assert np.linalg.norm(centre[:2] - on_a_circle(2)[:2]) < 0.3
    assert np.isfinite(run.predict(2)).all()
    assert read_json(run.path / "config.json")["background"] == "learned"
    kept = (run.path / "background.npz").read_bytes()
    train(walk, tmp_path / "run", config, [2])
    assert (run.path / "background.npz").read_bytes() == kept

    monkeypatch.undo()
    opened = open_run(run.path)
    evidence = Scene.of(opened).evidence(2, np.ones(Scene.of(opened).grid.shape, np.float32))
    seen = opened.observations(2)
    keep = seen.links[..., None] & seen.subcarriers
    np.testing.assert_allclose(evidence.delta[keep], seen.delta[keep], atol=1e-8)


def test_too_few_frames_are_refused(tiny_dataset: Path) -> None:
    with pytest.raises(RfgsError, match="holds 2 frames; expected at least 3"):
        learned_background(open_dataset(tiny_dataset).sequence(), "wifi", "clean", "complex")


def test_taking_movers_out_in_turn_leaves_less_of_them_in_the_room(
    walk: Path, quick_config, no_capture, monkeypatch
) -> None:
    sequence = open_dataset(walk).sequence()
    config = replace(quick_config, num_gaussians=100, solver_steps=8)
    first = learned_background(sequence, "wifi", "clean", "complex")
    monkeypatch.setattr(learned_background_module, "TURNS", 1)
    better = without_movers(sequence, "wifi", first, config)
    monkeypatch.undo()
    seen = observe(sequence, "wifi", 4)
    room = seen.static
    errors = [np.sum(np.abs(background - room) ** 2) for background in (first, better)]
    assert errors[1] < 0.8 * errors[0]
    keep = seen.links[..., None] & seen.subcarriers
    assert (better[~keep] == 0).all()


def test_where_nothing_moves_the_room_stays_as_it_is(walk: Path, quick_config, monkeypatch) -> None:
    sequence = open_dataset(walk).sequence()
    room = sequence.csi_static("wifi")
    monkeypatch.setattr(Sequence, "csi_samples", lambda *_, **__: room[None])
    monkeypatch.setattr(Sequence, "csi", lambda *_, **__: room)
    first = learned_background(sequence, "wifi", "clean", "complex")
    assert not observe(sequence, "wifi", 4, empty=first).changed
    np.testing.assert_array_equal(without_movers(sequence, "wifi", first, quick_config), first)
