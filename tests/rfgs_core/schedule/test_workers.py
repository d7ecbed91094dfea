# SPDX-License-Identifier: Apache-2.0
"""Worker processes that die, grow or are replaced cost time and nothing else."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.error import HTTPError
from urllib.request import urlopen

import psutil
import pytest

from rfgs_core.errors import RfgsError
from rfgs_core.schedule import answers
from rfgs_core.schedule.answers import Answer, answer_of, wants_fresh_process
from rfgs_core.schedule.workers import Workers, memory_bytes, workers_here

hoard: list[bytearray] = []


def misbehave(frame: int, marks: str) -> Answer:
    """What a worker does in these tests: some frames kill it, some make it grow."""
    from distributed import get_worker

    with open(marks, "a") as file:
        file.write(f"{frame}\n")
    # Long enough for what was done before to be fetched from this worker.
    time.sleep(0.2)
    tried = Path(marks).read_text().split().count(str(frame))
    if frame == 13 or (frame == 5 and tried == 1):
        os.kill(os.getpid(), signal.SIGKILL)
    if frame == 17:
        raise ValueError("no such triangle")
    if frame == 18:
        raise RfgsError("the wall is open")
    if frame == 99:
        hoard.append(bytearray(os.urandom(1)) * 600_000_000)
        time.sleep(60)
    if frame == 7:
        hoard.append(bytearray(os.urandom(1)) * 760_000_000)
    here: Any = get_worker()
    return answer_of(here, os.getpid(), {}, done=0)


@pytest.fixture
def marks(tmp_path: Path) -> Path:
    """The frames that workers were asked for, one a line."""
    (tmp_path / "marks").touch()
    return tmp_path / "marks"


@contextmanager
def starting(marks: Path, count: int = 2, memory_gb: float = 1.0) -> Iterator[Workers]:
    folder = marks.parent
    with workers_here(count, memory_gb, folder / "scratch", folder / "log") as workers:
        yield workers


@pytest.fixture(scope="module")
def two(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Workers]:
    """Two workers for every test that leaves workers behind, the same or new ones."""
    with starting(tmp_path_factory.mktemp("two") / "marks") as workers:
        yield workers


def run(workers: Workers, marks: Path, frames: list[int]) -> dict[int, Answer]:
    def submit(frame: int) -> Any:
        return workers.client.submit(misbehave, frame, str(marks), pure=False)

    return dict(workers.answers(frames, submit, doing="frame"))


def asked(marks: Path) -> list[int]:
    return sorted(int(frame) for frame in marks.read_text().split())


def test_a_worker_that_dies_costs_its_frame_one_try(two: Workers, marks: Path) -> None:
    assert sorted(run(two, marks, [3, 4, 5, 6])) == [3, 4, 5, 6]
    assert asked(marks) == [3, 4, 5, 5, 6]


def test_a_frame_that_kills_twice_is_named(two: Workers, marks: Path) -> None:
    with pytest.raises(RfgsError, match=r"frame failed: 13: its worker died \(tried twice\)"):
        run(two, marks, [13])
    assert asked(marks) == [13, 13]


def test_a_worker_that_grows_is_killed_and_named(marks: Path) -> None:
    message = r"frame failed: 99: a worker took more than 0.4 GB; raise --worker-memory"
    with starting(marks, memory_gb=0.4) as workers, pytest.raises(RfgsError, match=message):
        run(workers, marks, [99])
    assert asked(marks) == [99, 99]


def test_a_frame_that_cannot_be_traced_is_named_once(two: Workers, marks: Path) -> None:
    with pytest.raises(RfgsError, match=r"frame failed: 17: ValueError: no such triangle; the"):
        run(two, marks, [17])
    with pytest.raises(RfgsError, match=r"^the wall is open$"):
        run(two, marks, [18])
    assert asked(marks) == [17, 18]


def test_nothing_is_left_running(marks: Path) -> None:
    before = set(psutil.Process().children(recursive=True))
    begin = time.monotonic()
    with pytest.raises(RfgsError), starting(marks) as workers:
        running = set(psutil.Process().children(recursive=True)) - before
        run(workers, marks, [1, 2, 13, 4])
    assert time.monotonic() - begin < 20
    # multiprocessing's own tracker stays for the next run, and ends with this process.
    left = [p for p in running if p.is_running() and p.status() != psutil.STATUS_ZOMBIE]
    assert [p for p in left if "resource_tracker" not in " ".join(p.cmdline())] == []


@pytest.mark.slow
def test_a_worker_is_replaced_between_frames_when_it_is_nearly_full(marks: Path) -> None:
    with starting(marks, count=1, memory_gb=1.0) as workers:
        told = [run(workers, marks, [frame])[frame] for frame in (1, 2, 7, 3, 4)]
    first, second, full, fresh, last = (answer.value for answer in told)
    assert first == second == full != fresh == last
    assert told[2].memory_bytes > 760_000_000 > 1.5 * told[3].memory_bytes
    assert asked(marks) == [1, 2, 3, 4, 7]


def test_a_worker_is_replaced_after_so_many_frames() -> None:
    assert wants_fresh_process(10, 0, answers.FRESH_AFTER_TASKS)
    assert not wants_fresh_process(10, 0, answers.FRESH_AFTER_TASKS - 1)


def test_a_worker_killed_while_it_starts_is_replaced(marks: Path) -> None:
    me = psutil.Process()
    before = set(me.children(recursive=True))
    with starting(marks, count=1) as workers:
        for _ in range(3):
            started = set(me.children(recursive=True)) - before
            for process in [p for p in started if "spawn_main" in p.cmdline()[-2]]:
                process.kill()
            time.sleep(0.3)
        assert sorted(run(workers, marks, [1, 2])) == [1, 2]


def test_workers_listen_to_this_machine_alone_and_serve_no_page(two: Workers, marks: Path) -> None:
    run(two, marks, [1])
    me = psutil.Process()
    listening = [
        socket.laddr
        for process in [me, *me.children(recursive=True)]
        for socket in process.net_connections("inet")
        if socket.status == psutil.CONN_LISTEN
    ]
    assert listening and {address.ip for address in listening} == {"127.0.0.1"}
    served: Any = two.client.scheduler_info()
    pages = [row["services"].get("dashboard") for row in [served, *served["workers"].values()]]
    for port in filter(None, pages):
        for page in ("status", "info/main/workers.html", "metrics", "health"):
            with pytest.raises(HTTPError, match="404"):
                urlopen(f"http://127.0.0.1:{port}/{page}", timeout=5)


PROGRAM = """
import sys, time
from pathlib import Path
from rfgs_core.schedule.workers import workers_here

def hold(_):
    # Holds Python's lock, as compilers do.
    import ctypes
    from rfgs_core.children import end_with_parent
    end_with_parent()
    ctypes.PyDLL(None).sleep(60)

if __name__ == "__main__":
    folder = Path(sys.argv[1])
    with workers_here(2, 1.0, folder / "scratch", folder) as workers:
        work = workers.client.map(hold, [1, 2], pure=False)
        time.sleep(1.0)
        print("busy", flush=True)
        time.sleep(60)
"""


@pytest.mark.parametrize(
    "number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.slow), signal.SIGKILL]
)
def test_workers_end_with_the_run_however_it_ends(number: signal.Signals, tmp_path: Path) -> None:
    """Also while they compute and do not answer."""
    (tmp_path / "program.py").write_text(PROGRAM)
    process = subprocess.Popen(
        [sys.executable, str(tmp_path / "program.py"), str(tmp_path)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        # A shell that runs tests in the background has them ignore Ctrl-C.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        env={**os.environ, "PYTHONPATH": str(Path(__file__).resolve().parents[3])},
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "busy\n"
    children = psutil.Process(process.pid).children(recursive=True)
    assert len(children) >= 2
    if number == signal.SIGINT:
        # As a terminal does it: the whole group.
        os.killpg(process.pid, number)
    else:
        process.send_signal(number)
    _, said = process.communicate(timeout=20)
    assert psutil.wait_procs(children, timeout=10)[1] == []
    assert "distributed" not in said and said.count("Traceback") == (number == signal.SIGINT), said


def test_workers_share_the_memory_of_the_machine() -> None:
    total = psutil.virtual_memory().total
    assert memory_bytes(4, 0.0) == pytest.approx(0.9 * total / 4, rel=1e-6)
    assert memory_bytes(4, 2.5) == 2_500_000_000
