# SPDX-License-Identifier: Apache-2.0
"""What a dataset will take: its disk from above, its time from what was before."""

from __future__ import annotations

import json
import shutil
import subprocess
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, get_args

import pytest

from dataset_factory.cli.plan import PlanArgs
from dataset_factory.cli.plan import run as run_plan
from dataset_factory.make.generate import generate
from dataset_factory.plan.disk import Space
from dataset_factory.plan.job import Job
from dataset_factory.plan.price import price_line
from dataset_factory.plan.stages import Size, size_of_outline, speeds_noted, stages
from dataset_factory.plan.tracers import TracerName
from dataset_factory.plan.usual import PACKET, render_step_s
from dataset_factory.scene.outline import Outline
from rfgs_core import interrupts
from rfgs_core.errors import RfgsError
from rfgs_core.past import Clock, Speed, Stage, forecast
from rfgs_core.radio import PRESETS

MakeJob = Callable[..., Job]
Factory = Callable[..., subprocess.CompletedProcess[str]]


def measured(ends_s: list[float], at_once: int, first: int = 0) -> Speed | None:
    times = iter([0.0, *ends_s])
    clock = Clock(at_once, first, now=lambda: next(times))
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


def test_a_first_frame_that_compiles_is_part_of_the_start() -> None:
    speed = measured([1.0, 61.0, 64.0, 67.0], 1, first=1)
    assert speed == Speed(55.0, 3.0)
    assert measured([1.0, 61.0], 1, first=1) is None


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


@pytest.fixture
def no_past(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine on which nothing ever ran."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


def size(job: Job, frames: int = 100) -> Size:
    """A scene of one person and four access points, pictures of the job's resolution."""
    devices = [{"name": str(n), "radio": "any", "role": "ACCESS_POINT"} for n in range(4)]
    return size_of_outline(job.plan, Outline(list(range(frames)), devices, 3, 0.5, 1, 10.0))


def run_of(job: Job, **speeds: Speed) -> None:
    """As if a run had gone so fast."""
    with speeds_noted(job, size(job)):
        job.speeds.update({name.replace("_", " "): speed for name, speed in speeds.items()})


def test_a_machine_that_never_ran_is_told_usual_speeds(
    make_job: MakeJob, tmp_path: Path, no_past: None
) -> None:
    job = make_job(tmp_path)
    found = forecast(stages(job, size(job)))
    usual = "estimated from usual speeds of two cores; becomes exact after the first frames"
    assert found.source == usual and not found.measured
    assert set(found.seconds) == {"export", "trace wifi", "render"}
    line = price_line(job, size(job), 2e6)
    assert line.startswith("100 frames of 1 radio, 101 pictures; at most 2.0 MB; about")
    assert usual in line


def test_a_radio_in_the_past_tells_of_itself_and_scales_the_rest(
    make_job: MakeJob, tmp_path: Path, no_past: None
) -> None:
    job = make_job(tmp_path)
    usual = {stage.name: stage.usual for stage in stages(job, size(job))}
    run_of(job, trace_wifi=Speed(5.0, 3.0 * usual["trace wifi"].step_s))
    found = forecast(stages(job, size(job)))
    assert found.seconds["trace wifi"] == pytest.approx(5 + 303 * usual["trace wifi"].step_s)
    assert found.seconds["export"] == pytest.approx(3.0 * usual["export"].seconds(100))
    assert "usual speeds of two cores scaled to this machine" in found.source
    other = make_job(tmp_path, seed=1, frames="1:9")
    assert "trace wifi" in forecast(stages(other, size(other))).measured, "seed and frames are free"
    fewer = make_job(tmp_path, workers=2)
    assert "trace wifi" not in forecast(stages(fewer, size(fewer))).measured


def test_one_run_tells_of_larger_pictures_and_more_cameras(
    make_job: MakeJob, tmp_path: Path, no_past: None
) -> None:
    small = make_job(tmp_path)
    large = replace(small, plan=replace(small.plan, resolution=512, cameras=3))
    usual = {stage.name: stage for stage in stages(large, size(large))}["render"]
    assert usual.steps == 3 * 101
    run_of(small, render=Speed(1.0, 2.0 * render_step_s(32 * 16, small.plan.samples)))
    found = forecast([usual])
    assert found.scaled and not found.measured
    assert found.total_s == pytest.approx(2.0 * forecast_of(usual))


def forecast_of(stage: Stage) -> float:
    """What a stage takes at its usual speed [s]."""
    return stage.usual.seconds(stage.steps) + (stage.starts - 1) * stage.usual.start_s


def test_more_people_packets_and_devices_take_longer(make_job: MakeJob, tmp_path: Path) -> None:
    def step_s(people: int = 1, devices: int = 4, packets: int = 1, **options: int) -> float:
        job = make_job(tmp_path, **options)
        job = replace(job, plan=replace(job.plan, packets_per_frame=packets))
        rows = [{"name": str(n), "radio": "any", "role": "ACCESS_POINT"} for n in range(devices)]
        outline = Outline([1], rows, 1, 1.0, people, 10.0)
        return stages(job, size_of_outline(job.plan, outline))[1].usual.step_s

    assert step_s(people=4) == pytest.approx(4.0 * step_s())
    assert step_s(devices=2) == pytest.approx(0.25 * step_s())
    # 8 packets within 87.5 ms: traced six times, and seven more sums.
    assert step_s(packets=8) == pytest.approx((6 + 7 * PACKET["sionna"]) * step_s())
    assert step_s(workers=1) == pytest.approx(2.0 * step_s(workers=2))


def test_every_radio_of_every_tracer_has_a_usual_speed(make_job: MakeJob, tmp_path: Path) -> None:
    job = make_job(tmp_path)
    for tracer in get_args(TracerName):
        for depth in (1, 2, 3):
            radios = [name for name, radio in PRESETS.items() if depth <= radio.deepest]
            radios = [name for name in radios if tracer == "sionna" or name != "sar"]
            plan = replace(job.plan, radios=radios, depth=depth, tracer=tracer)
            asked = replace(job, plan=plan)
            found = stages(asked, size(asked))
            kinds = [stage.kind for stage in found if stage.name.startswith("trace")]
            assert kinds == [f"trace-{tracer}-{name}-{depth}" for name in radios]


def test_a_damaged_note_of_the_past_is_as_none(
    make_job: MakeJob, tmp_path: Path, no_past: None
) -> None:
    job = make_job(tmp_path)
    run_of(job, trace_wifi=Speed(5.0, 3.0))
    (note,) = (tmp_path / "cache").rglob("trace*.json")
    note.write_text("{")
    assert not forecast(stages(job, size(job))).measured


ARGUMENTS = ["--radio", "wifi", "--frames", "1:4", "--cameras", "1", "--resolution", "32"]
ARGUMENTS += ["--samples", "2", "--depth", "1", "--workers", "1"]


def test_a_plan_makes_nothing_and_counts_what_generate_would(
    factory: Factory, box_room: Path, tmp_path: Path
) -> None:
    cache = {"XDG_CACHE_HOME": str(tmp_path / "cache")}
    out = tmp_path / "out"
    begun_s = time.monotonic()
    done = factory("plan", str(box_room), *ARGUMENTS, "--out", str(out), **cache)
    assert done.returncode == 0, done.stderr
    assert time.monotonic() - begun_s < 30.0
    assert not out.exists(), "a plan makes nothing"
    assert "frames  4, 1 cameras, 5 pictures, 1 workers" in done.stdout
    assert "becomes exact after the first frames" in done.stdout
    (disk,) = [row for row in done.stdout.splitlines() if row.startswith("disk")]
    # Five channels of 4 x 256 x 64 values.
    assert 2.6 < float(disk.split()[1]) < 5.0


def test_a_stopped_plan_says_what_is_true(monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    def stopped(_args: Any) -> None:
        interrupts.say_stopped()
        raise KeyboardInterrupt

    monkeypatch.setattr(interrupts, "_message", interrupts.MESSAGE)
    monkeypatch.setattr("dataset_factory.cli.plan.job_of", stopped)
    with pytest.raises(KeyboardInterrupt):
        run_plan(PlanArgs("living_room_walk", Path("nowhere")))
    assert capsys.readouterr().err == "\nstopped; nothing was made\n"


@pytest.mark.slow
def test_a_plan_after_a_run_is_of_its_times(
    factory: Factory, box_room: Path, tmp_path: Path
) -> None:
    cache = {"XDG_CACHE_HOME": str(tmp_path / "cache")}
    arguments = [str(box_room), *ARGUMENTS, "--out", str(tmp_path / "out")]
    made = factory("generate", *arguments, **cache)
    assert made.returncode == 0, made.stderr
    assert "estimated from usual speeds of two cores" in made.stderr
    took = json.loads((tmp_path / "out" / "log" / "generate.json").read_text())["seconds"]
    done = factory("plan", *arguments, **cache)
    assert done.returncode == 0 and "as measured here before" in done.stdout, done.stdout
    (row,) = [row for row in done.stdout.splitlines() if row.startswith("time")]
    total_s = sum(took[stage] for stage in ("export", "trace", "render"))
    number, unit = row.split()[1:3]
    planned_s = float(number) * {"s": 1, "min": 60, "h": 3600}[unit.rstrip(":,")]
    assert planned_s == pytest.approx(total_s, rel=0.3)
