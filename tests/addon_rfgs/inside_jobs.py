# SPDX-License-Identifier: Apache-2.0
"""The queue of jobs, their records and logs; `test_inside_blender.py` runs this file."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from pretended_jobs import plan, rewrite

from addon_rfgs.errors import AddonError
from addon_rfgs.jobs import queue
from addon_rfgs.jobs.plans import (
    EvaluatePlan,
    GeneratePlan,
    TrainPlan,
    plan_of_json,
    plan_to_json,
    with_blender,
)
from addon_rfgs.jobs.process import Process, birth
from addon_rfgs.jobs.progress import Progress, read_log
from addon_rfgs.jobs.record import (
    Record,
    log_file,
    read_record,
    record_file,
    remembered,
    write_record,
)

pytest_plugins = ["pretended_jobs"]


def step_until(jobs: queue.Queue, job: queue.Job, *states: str) -> None:
    end_s = time.monotonic() + 20
    while job.state not in states:
        assert time.monotonic() < end_s, f"{job.state}: {job.message}"
        jobs.step()
        time.sleep(0.02)


def step_until_said(jobs: queue.Queue, job: queue.Job, text: str) -> None:
    end_s = time.monotonic() + 20
    while text not in job.tail:
        assert time.monotonic() < end_s
        jobs.step()
        time.sleep(0.02)


def test_jobs_run_one_after_the_other(jobs, program, tmp_path: Path) -> None:
    first = jobs.add(plan(tmp_path, "a"), program("polite"))
    second = jobs.add(plan(tmp_path, "b"), program("quick"))
    step_until_said(jobs, first, "begun")
    for _ in range(5):
        jobs.step()
    assert (first.state, second.state) == (queue.RUNNING, queue.WAITING)
    jobs.stop(first)
    step_until(jobs, second, queue.DONE)
    assert first.state == queue.STOPPED and second.tail == ["at work"]
    assert not jobs.step(), "nothing is left to look after"
    assert remembered(tmp_path / "jobs.json") == [record_file(first.plan)]
    jobs.forget(first)
    assert not (tmp_path / "jobs.json").exists() and record_file(first.plan).exists()


def test_a_failure_is_told_in_its_own_words(jobs, program, tmp_path: Path) -> None:
    job = jobs.add(plan(tmp_path, "a"), program("failing"))
    step_until(jobs, job, queue.FAILED)
    assert job.message == "no wall anywhere"
    gone = jobs.add(plan(tmp_path, "b"), tmp_path / "nothing")
    step_until(jobs, gone, queue.FAILED)
    assert "cannot be started" in gone.message


def test_who_does_not_stop_is_killed(jobs, program, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(queue, "GRACE_S", 0.3)
    job = jobs.add(plan(tmp_path, "a"), program("deaf"))
    step_until_said(jobs, job, "begun")
    jobs.stop(job)
    jobs.step()
    assert job.state == queue.STOPPING
    step_until(jobs, job, queue.STOPPED)
    assert not birth(job.process.pid)


def test_a_second_job_for_the_folder_waits_its_turn(jobs, program, tmp_path: Path) -> None:
    job = jobs.add(plan(tmp_path, "a"), program("quick"))
    with pytest.raises(AddonError, match="in the list already"):
        jobs.add(plan(tmp_path, "a"), program("quick"))
    with pytest.raises(AddonError, match="not over"):
        jobs.forget(job)
    jobs.stop(job)
    assert job.state == queue.STOPPED and not jobs.step()
    again = jobs.add(plan(tmp_path, "a"), program("quick"))
    assert jobs.jobs == [again]


@pytest.mark.parametrize("done", [True, False])
def test_the_next_blender_finds_a_job_and_its_end(
    jobs, program, tmp_path: Path, done: bool
) -> None:
    job = jobs.add(plan(tmp_path, "a"), program("polite"))
    step_until_said(jobs, job, "begun")
    later = queue.Queue(lambda: None)
    later.restore(read_record(remembered(tmp_path / "jobs.json")[0]))
    assert later.jobs[0].state == queue.RUNNING and later.jobs[0].tail == ["begun"]
    if done:
        (tmp_path / "a" / "point_cloud.ply").touch()
    later.stop(later.jobs[0])
    step_until(jobs, job, queue.STOPPED)
    later.step()
    assert later.jobs[0].state == (queue.DONE if done else queue.STOPPED)


def test_one_folder_is_worked_on_by_one_job(jobs, program, tmp_path: Path) -> None:
    job = jobs.add(plan(tmp_path, "a"), program("polite"))
    step_until_said(jobs, job, "begun")
    other = queue.Queue(lambda: tmp_path / "jobs.json")
    with pytest.raises(AddonError, match="another Blender's job is running"):
        other.add(plan(tmp_path, "a"), program("quick"))
    second = other.add(plan(tmp_path, "b"), program("quick"))
    assert remembered(tmp_path / "jobs.json") == [record_file(row.plan) for row in (job, second)]
    step_until(other, second, queue.DONE)
    assert remembered(tmp_path / "jobs.json") == [record_file(job.plan)]
    jobs.stop(job)
    step_until(jobs, job, queue.STOPPED)
    step_until(other, other.add(plan(tmp_path, "a"), program("quick")), queue.DONE)


def test_an_old_evaluation_is_not_taken_for_a_new_one(tmp_path: Path) -> None:
    made = EvaluatePlan(str(tmp_path))
    (tmp_path / "metrics.json").touch()
    write_record(Record(made, 0, ""))
    os.utime(tmp_path / "metrics.json", (1, 1))
    assert not made.complete()
    os.utime(tmp_path / "metrics.json")
    assert made.complete()


def test_another_process_of_that_number_is_left_alone(jobs, tmp_path: Path) -> None:
    with subprocess.Popen(["sleep", "60"], start_new_session=True) as child:
        stranger = Process(child.pid, "born at another time")
        assert not stranger.running()
        stranger.interrupt()
        stranger.kill()
        assert child.poll() is None
        child.kill()


@pytest.mark.parametrize(
    "damage",
    [
        lambda row: [],
        lambda row: {**row, "schema": "other"},
        lambda row: {**row, "kind": "rm"},
        lambda row: {**row, "pid": "1"},
        lambda row: {**row, "pid": -1},
        lambda row: {**row, "settings": {**row["settings"], "shell": "rm -rf /"}},
        lambda row: {**row, "settings": {**row["settings"], "seed": "0"}},
        lambda row: {**row, "settings": {**row["settings"], "dataset": "relative"}},
        lambda row: {**row, "settings": {**row["settings"], "out": "/elsewhere"}},
        lambda row: {**row, "settings": {"out": row["settings"]["out"]}},
    ],
)
def test_records_from_anywhere_are_refused_in_one_line(
    jobs, tmp_path: Path, damage, program
) -> None:
    job = jobs.add(plan(tmp_path, "a"), program("quick"))
    file = record_file(job.plan)
    rewrite(file, damage(json.loads(file.read_text())))
    with pytest.raises(AddonError) as caught:
        read_record(file)
    assert "\n" not in str(caught.value) and str(file) in str(caught.value)


def test_plans_come_back_and_values_cannot_become_options(tmp_path: Path) -> None:
    made = GeneratePlan(
        str(tmp_path), "/a b.blend", radios="wifi, mmwave", frames="--help", depth=1
    )
    assert plan_of_json(json.loads(json.dumps(plan_to_json(made))), tmp_path) == made
    command = made.arguments()
    assert "/a b.blend" in command and "--frames=--help" in command
    assert [text for text in command if text.startswith("--radio")] == [
        "--radio=wifi",
        "--radio=mmwave",
    ]
    with pytest.raises(AddonError, match="no radio"):
        GeneratePlan(str(tmp_path), "/a.blend", radios=" ,").arguments()


def test_no_record_names_a_program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = GeneratePlan(str(tmp_path), "/a.blend", blender="/chosen/blender")
    kept = plan_to_json(made)
    assert "blender" not in json.dumps(kept["settings"])
    # One of an earlier version, or of somebody who wants theirs to be run.
    kept["settings"]["blender"] = "/evil/blender"
    back = plan_of_json(kept, tmp_path)
    assert "evil" not in " ".join(back.arguments())
    assert "--blender=/own/blender" in with_blender(back, "/own/blender").arguments()
    train = TrainPlan(str(tmp_path), str(tmp_path))
    assert with_blender(train, "/own/blender") == train


#: Values for every setting of a job, by somebody who wants something else to run.
HOSTILE = (
    *("--blender=/evil", "-c", "/evil; rm -rf /", "$(evil)", "/a\n--x", "\0", "../..", "/" * 5000),
    *(-1, 0, True, None, 10**9, 10**400, 1e308, [], {}, ["/evil"]),
)
_OPTIONS = (
    *("out", "radio", "frames", "depth", "cameras", "resolution", "samples", "workers", "seed"),
    *("iterations", "gaussians"),
)


@pytest.mark.parametrize("kind", ["generate", "train", "evaluate"])
def test_a_record_of_an_adversary_starts_our_commands_alone(tmp_path: Path, kind: str) -> None:
    made = {
        "generate": GeneratePlan(str(tmp_path), "/a.blend"),
        "train": TrainPlan(str(tmp_path), "/data"),
        "evaluate": EvaluatePlan(str(tmp_path)),
    }[kind]
    write_record(Record(made, 1, ""))
    file = record_file(made)
    sound = json.loads(file.read_text())
    rows = [
        {**sound, "settings": {**sound["settings"], name: value}}
        for name in (*sound["settings"], "blender", "python", "env", "arguments")
        for value in HOSTILE
    ]
    rows += [{**sound, name: value} for name in (*sound, "python", "argv") for value in HOSTILE]
    accepted = 0
    for row in rows:
        rewrite(file, row)
        try:
            arguments = with_blender(read_record(file).plan, "/own/blender").arguments()
        except AddonError as error:
            assert "\n" not in str(error)
            continue
        accepted += 1
        module, command, *rest = arguments[1:]
        ours = {
            "generate": "dataset_factory",
            "train": "rfgs_core.cli",
            "evaluate": "rfgs_core.cli",
        }
        assert arguments[0] == "-m" and module == ours[kind]
        assert command == {"evaluate": "eval"}.get(kind, kind)
        for text in rest:
            name, equals, value = text.removeprefix("--").partition("=")
            path = text.startswith("/")
            switch = text in ("--no-paths", "--paths", "--images", "--no-images", "--oracle")
            option = text.startswith("--") and equals and name in _OPTIONS
            program = (name, value) == ("blender", "/own/blender")
            assert path or switch or option or program or text == "--no-oracle", text
    assert 10 < accepted < len(rows) / 2


@pytest.mark.parametrize("name", ["log/job_train.json", "log/job_train.log"])
def test_a_job_waits_for_no_pipe(jobs, tmp_path: Path, program, name: str) -> None:
    place = Path(plan(tmp_path, "a").out, name)
    place.parent.mkdir(parents=True, exist_ok=True)
    os.mkfifo(place)
    with pytest.raises(AddonError, match="expected a file"):
        jobs.add(plan(tmp_path, "a"), program("quick"))
    with pytest.raises(AddonError, match="expected a file" if ".json" in name else "No such file"):
        read_record(record_file(plan(tmp_path, "a")))
    assert read_log(log_file(plan(tmp_path, "a"))) == (None, [])


@pytest.mark.parametrize("name", ["log", "log/job_train.json", "log/job_train.log"])
def test_a_job_writes_through_no_link(jobs, tmp_path: Path, program, name: str) -> None:
    victim = tmp_path / "victim"
    victim.mkdir()
    (victim / "file").write_text("mine")
    out = plan(tmp_path, "a").out
    place = Path(out, name)
    place.parent.mkdir(parents=True, exist_ok=True)
    place.symlink_to(victim if name == "log" else victim / "file")
    with pytest.raises(AddonError, match="a symbolic link"):
        jobs.add(plan(tmp_path, "a"), program("quick"))
    assert [file.name for file in victim.iterdir()] == ["file"]
    assert (victim / "file").read_text() == "mine"


def test_bars_of_the_programs_are_read(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setenv("PYTHONHOME", "/nowhere")
    log = tmp_path / "log"
    code = (
        "from tqdm import tqdm; import time; print('first')\n"
        "with tqdm(desc='export', unit='frame') as bar: bar.total = 2; bar.update(2)\n"
        "bar = tqdm(total=40, desc='trace wifi', mininterval=0); bar.update(0)\n"
        "for _ in range(10): time.sleep(0.02); bar.update()\n"
        "print('\\nlast'); import os; os._exit(0)\n"
    )
    process = Process.start([sys.executable, "-c", code], log)
    while process.running():
        time.sleep(0.05)
    progress, tail = read_log(log)
    assert process.code == 0 and tail == ["first", "last"], log.read_text()
    assert progress.stage == "trace wifi" and (progress.done, progress.total) == (10, 40)
    assert 0 < progress.left_s <= 10 and progress.share == 0.25


def test_logs_of_any_bytes_are_read(tmp_path: Path) -> None:
    log = tmp_path / "log"
    log.write_bytes(os.urandom(50_000) + b"\rprogress 3 7 75 render: \r\x1b[Aend\n")
    progress, tail = read_log(log, 1)
    assert str(progress) == "render 3/7, 1:15 left" and tail == ["end"]
    assert str(Progress("export", 7, 7, 0)) == "export 7/7"
    assert read_log(tmp_path / "none") == (None, [])


def test_the_log_lies_in_the_output_folder(tmp_path: Path) -> None:
    made = plan(tmp_path, "run")
    assert log_file(made) == tmp_path / "run" / "log" / "job_train.log"
