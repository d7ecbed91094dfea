# SPDX-License-Identifier: Apache-2.0
"""User mistakes become one line and an exit code; mistakes of ours keep their traceback."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from rfgs_core.errors import MissingToolError, RfgsError, RfgsFormatError
from rfgs_core.files import write_text
from rfgs_core.outcome import run_cli

ROOT = Path(__file__).resolve().parents[2]


def raising(error: BaseException):
    def command() -> int | None:
        raise error

    return command


@pytest.mark.parametrize(("answer", "code"), [(None, 0), (0, 0), (1, 1), (3, 3)])
def test_the_commands_own_code_is_passed_on(answer: int | None, code: int, capsys) -> None:
    assert run_cli(lambda: answer) == code
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("kind", [RfgsError, RfgsFormatError, MissingToolError])
def test_a_user_mistake_is_one_line_and_code_2(kind: type[RfgsError], capsys) -> None:
    assert run_cli(raising(kind("a.json: expected 1, got 2"))) == 2
    assert capsys.readouterr() == ("", "error: a.json: expected 1, got 2\n")


def test_a_place_that_cannot_be_written_is_one_line(tmp_path: Path, capsys) -> None:
    (tmp_path / "file").write_text("")
    (tmp_path / "folder").mkdir()
    for place in (tmp_path / "folder", tmp_path / "file" / "below", tmp_path / ("n" * 300)):
        assert run_cli(lambda place=place: write_text(place, "text")) == 2
        out, err = capsys.readouterr()
        assert out == "" and err.count("\n") == 1
        assert err.startswith(f"error: {tmp_path}") and "; check the path and who may use it" in err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "folder"]


def test_format_errors_are_value_errors_too() -> None:
    assert issubclass(RfgsFormatError, ValueError)
    assert issubclass(RfgsFormatError, RfgsError)


@pytest.mark.usefixtures("hears_ctrl_c")
def test_ctrl_c_says_how_to_continue(capsys) -> None:
    def command() -> None:
        signal.raise_signal(signal.SIGINT)

    assert run_cli(command) == 130
    out, err = capsys.readouterr()
    assert out == ""
    assert "run the same command to continue" in err
    assert "Traceback" not in err


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full on this system")
def test_a_full_disk_is_one_line(capsys) -> None:
    def command() -> None:
        with open("/dev/full", "wb", buffering=0) as stream:
            stream.write(b"x")

    assert run_cli(command) == 2
    err = capsys.readouterr().err
    assert err.startswith("error: the disk is full;")
    assert err.count("\n") == 1


def test_a_full_disk_names_the_file_where_the_system_does(capsys) -> None:
    assert run_cli(raising(OSError(errno.ENOSPC, "No space left", "/x/csi.bin"))) == 2
    assert "while writing /x/csi.bin;" in capsys.readouterr().err


@pytest.mark.parametrize("error", [PermissionError(errno.EACCES, "no"), KeyError("x")])
def test_other_errors_are_not_hidden(error: Exception) -> None:
    with pytest.raises(type(error)):
        run_cli(raising(error))


def test_a_reader_that_stops_is_no_error() -> None:
    """As `rfgs train --help | head` does."""
    program = [sys.executable, "-m", "rfgs_core.cli", "train", "--help"]
    reads, writes = os.pipe()
    os.close(reads)
    try:
        done = subprocess.run(
            program,
            stdout=writes,
            stderr=subprocess.PIPE,
            text=True,
            timeout=60,
            cwd=ROOT,
            check=False,
        )
    finally:
        os.close(writes)
    assert done.returncode == 1
    assert done.stderr == ""


@pytest.mark.parametrize(
    "program",
    [["rfgs_core.cli"], ["rfgs_core.cli", "train"], ["dataset_factory"], ["addon_rfgs"]],
)
@pytest.mark.parametrize("unbuffered", ["1", ""])
def test_help_that_nobody_reads_to_its_end_is_no_error(program: list[str], unbuffered: str) -> None:
    """As `rfgs --help | head -1` does; with a full buffer, and with none."""
    reader, writer = os.pipe()
    os.close(reader)
    try:
        done = subprocess.run(
            [sys.executable, "-m", *program, "--help"],
            stdout=writer,
            stderr=subprocess.PIPE,
            env={**os.environ, "PYTHONUNBUFFERED": unbuffered},
            cwd=ROOT,
            text=True,
            check=False,
        )
    finally:
        os.close(writer)
    assert (done.stderr, done.returncode) == ("", 1)


def test_a_program_that_calls_another_says_once_that_it_stopped(tmp_path: Path) -> None:
    """Ctrl-C reaches both, as they share a terminal."""
    (tmp_path / "inner.py").write_text(
        "import time\n"
        "from rfgs_core.interrupts import run_program\n"
        "def main():\n    print('begun', flush=True)\n    time.sleep(30)\n"
        "if __name__ == '__main__':\n    run_program('inner')\n"
    )
    (tmp_path / "outer.py").write_text(
        "from rfgs_core.interrupts import run_program\n"
        "def main():\n"
        "    from rfgs_core.cli.calls import call\n"
        "    from rfgs_core.outcome import run_cli\n"
        "    return run_cli(lambda: call('inner'))\n"
        "if __name__ == '__main__':\n    run_program('outer')\n"
    )
    with subprocess.Popen(
        [sys.executable, "outer.py"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": f"{tmp_path}{os.pathsep}{ROOT}"},
        process_group=0,
        text=True,
    ) as outer:
        assert outer.stdout is not None and outer.stdout.readline() == "begun\n"
        os.killpg(outer.pid, signal.SIGINT)
        _, told = outer.communicate(timeout=30)
    assert outer.returncode == 130
    assert told.count("stopped") == 1 and "Traceback" not in told
