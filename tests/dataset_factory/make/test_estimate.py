# SPDX-License-Identifier: Apache-2.0
"""What a dataset will take: its disk from above, its time from the speed of a few frames."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

from dataset_factory.make.estimate import estimate
from dataset_factory.make.generate import generate
from dataset_factory.plan.disk import Space
from dataset_factory.plan.job import Job
from dataset_factory.plan.speed import Clock, Speed
from rfgs_core.errors import RfgsError

MakeJob = Callable[..., Job]
Factory = Callable[..., subprocess.CompletedProcess[str]]


def measured(ends_s: list[float], at_once: int) -> Speed | None:
    times = iter([0.0, *ends_s])
    clock = Clock(at_once, now=lambda: next(times))
    for _ in ends_s:
        clock.step()
    return clock.speed()


@pytest.mark.parametrize("processes", [1, 2, 3])
def test_the_pace_of_equal_frames_is_exact(processes: int) -> None:
    """Every process starts for 7 s, then takes 3 s a frame."""
    ends = [7.0 + 3.0 * (turn + 1) for turn in range(4) for _ in range(processes)]
    speed = measured(ends, processes)
    assert speed is not None
    assert speed.step_s == pytest.approx(3.0 / processes, rel=0.01)
    assert speed.seconds(400 * processes) == pytest.approx(7.0 + 1200.0, rel=0.01)


def test_too_few_frames_tell_nothing() -> None:
    assert measured([], 1) is None
    assert measured([5.0], 1) is None
    assert measured([5.0, 5.0, 8.0], 2) is None


def test_disk_is_estimated_from_above_and_closely(watched_box: tuple[Path, list[Space]]) -> None:
    out, estimates = watched_box
    channels = [file for file in out.rglob("*") if file.is_file() and "/c/" in str(file)]
    pictures = [file for file in out.rglob("*") if file.suffix in (".png", ".exr")]
    size = sum(file.stat().st_size for file in [*channels, *pictures])
    assert size < estimates[0].bytes(2)
    # Links are all measured, so channels hardly compress; pictures of 32 px are small.
    raw = 3 * 4 * 256 * 64 * 8
    assert raw < estimates[0].bytes(2) < 1.2 * raw


def test_a_disk_that_is_too_small_is_refused_before_tracing(
    make_job: MakeJob, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shutil, "disk_usage", lambda _path: SimpleNamespace(free=1_000_000))
    job = make_job(tmp_path / "new" / "out")
    with pytest.raises(RfgsError, match=r"needs about 1.\d MB more, 1.0 MB are free; take fewer"):
        generate(job)
    assert not (tmp_path / "new").exists(), "what was refused leaves no folder"


def test_a_disk_that_is_full_by_now_costs_nothing_that_was_made(
    make_job: MakeJob, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    job = make_job(tmp_path / "out")
    with monkeypatch.context() as patch:
        patch.setattr("dataset_factory.make.generate.trace", _stop)
        with pytest.raises(KeyboardInterrupt):
            generate(job)
    before = sorted(tmp_path.rglob("*"))
    monkeypatch.setattr(shutil, "disk_usage", lambda _path: SimpleNamespace(free=1_000_000))
    with pytest.raises(RfgsError, match="are free"):
        generate(job)
    assert sorted(tmp_path.rglob("*")) == before


def _stop(*_arguments: object) -> None:
    raise KeyboardInterrupt


def test_frames_of_a_foreign_file_must_be_said(make_job: MakeJob, tmp_path: Path) -> None:
    with pytest.raises(RfgsError, match="give the frames to plan for"):
        estimate(make_job(tmp_path, frames=""), "")


@pytest.mark.slow
def test_plan_measures_once_and_then_remembers(
    factory: Factory, box_room: Path, tmp_path: Path
) -> None:
    arguments = ["plan", str(box_room), "--radio", "wifi", "--frames", "1:4", "--cameras", "1"]
    arguments += ["--resolution", "32", "--samples", "2", "--depth", "1", "--workers", "1"]
    arguments += ["--out", str(tmp_path / "out")]
    cache = {"XDG_CACHE_HOME": str(tmp_path / "cache")}
    answers = [factory(*arguments, **cache) for _ in range(2)]
    assert [answer.returncode for answer in answers] == [0, 0], answers[0].stderr
    assert "the first frames, made just now and kept in" in answers[0].stdout
    assert "an earlier run" in answers[1].stdout
    assert "frames  4, 1 cameras, 1 workers" in answers[1].stdout
    out = tmp_path / "out"
    kept = {file: file.stat().st_mtime_ns for file in out.rglob("done/0*")}
    assert kept, "frames that were made"
    seconds = [row for row in answers[1].stdout.splitlines() if row.startswith("time")]
    assert seconds and all(stage in seconds[0] for stage in ("export", "trace wifi", "render"))
    other = factory(*["2:4" if word == "1:4" else word for word in arguments], **cache)
    assert other.returncode == 0 and "an earlier run" in other.stdout
    made = factory("generate", *arguments[1:], **cache)
    assert made.returncode == 0, made.stderr
    assert "about" in made.stderr and "as measured here before" in made.stderr
    assert {file: file.stat().st_mtime_ns for file in kept} == kept, "nothing is made twice"
    assert not (out / ".work").exists()


@pytest.mark.slow
def test_a_plan_for_other_settings_replaces_what_only_a_plan_has_made(
    factory: Factory, box_room: Path, tmp_path: Path
) -> None:
    settings = ["--radio", "wifi", "--frames", "1:4", "--cameras", "1", "--no-images"]
    settings += ["--depth", "1", "--workers", "1", "--out", str(tmp_path / "out")]
    cache = {"XDG_CACHE_HOME": str(tmp_path / "cache")}
    for seed in ("1", "2"):
        done = factory("plan", str(box_room), *settings, "--seed", seed, **cache)
        assert done.returncode == 0, done.stderr
        cache = {"XDG_CACHE_HOME": str(tmp_path / f"cache{seed}")}
    made = factory("generate", str(box_room), *settings, "--seed", "2", **cache)
    assert made.returncode == 0, made.stderr
    refused = factory("plan", str(box_room), *settings, "--seed", "3", **cache)
    assert refused.returncode in (0, 2)
    assert (tmp_path / "out" / "MANIFEST.sha256").is_file(), "a dataset is never replaced"
