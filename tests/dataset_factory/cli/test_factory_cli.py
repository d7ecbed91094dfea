# SPDX-License-Identifier: Apache-2.0
"""Bad input gets one clear line and a non-zero exit."""

from __future__ import annotations

import errno
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from dataset_factory import cli
from dataset_factory.plan.contents import frame_runs
from rfgs_core.dataset.csi_store import chunk_file
from rfgs_core.errors import MissingToolError
from rfgs_core.frames import parse_frames

Factory = Callable[..., subprocess.CompletedProcess[str]]
BuildScene = Callable[..., Path]


def one_line(answer: subprocess.CompletedProcess[str]) -> str:
    """The only error line of a failed command."""
    assert answer.returncode not in (0, None), answer
    assert "Traceback" not in answer.stderr, answer.stderr
    lines = [line for line in answer.stderr.splitlines() if line.startswith("error:")]
    assert len(lines) == 1, answer.stderr
    return lines[0]


def test_scenes_lists_the_catalogue(factory: Factory) -> None:
    answer = factory("scenes")
    assert answer.returncode == 0 and "living_room_walk" in answer.stdout


def test_help_teaches(factory: Factory) -> None:
    answer = factory("--help")
    assert answer.returncode == 0
    assert all(word in answer.stdout for word in ("generate", "validate", "preview", "--radio"))
    assert one_line(factory("destroy")).startswith("error: unknown command 'destroy'")


#: Bounds whose diagonal is 25.63 m: 2 · 25.63 + 5 = 56.27 m, 4 GHz · 56.27 m / c = 750.8
# subcarriers.
WIDE = ["--bounds", "-8", "-8", "0", "10", "10", "3"]


@pytest.mark.parametrize(
    ("scene", "radio", "more", "words"),
    [
        ("missing.blend", "wifi", [], ["missing.blend", "no such Blender file"]),
        ("nowhere", "wifi", [], ["no scene 'nowhere'", "living_room_walk"]),
        ("text.blend", "wifi", [], ["text.blend", "not a Blender file"]),
        ("room", "lora", [], ["unknown radio 'lora'", "wifi_commodity, wifi24", "my_radio.yaml"]),
        ("room", "wifi", ["--frames", "5:"], ["--frames '5:'", "FIRST:LAST"]),
        ("room", "wifi", ["--frames", "9:1"], ["FIRST <= LAST"]),
        ("room", "wifi", ["--depth", "4"], ["--depth 4", "1 to 3"]),
        ("room", "uwb", ["--depth", "2"], ["'uwb', trace depth 2", "ultra-wide", "use --depth 1"]),
        ("through_wall", "uwb", [], ["trace depth 3", "'uwb' is traced at 1", "another radio"]),
        ("room", "mmwave", WIDE, ["reach 56.3 m", "`like: mmwave`", "num_subcarriers: 751`"]),
        ("room", "wifi", ["--workers", "0"], ["--workers 0"]),
        ("room", "wifi", ["--frames", "90:95"], ["90:95"]),
        ("room", "wifi", ["--blender", "/no/blender"], ["/no/blender: no such program"]),
    ],
)
def test_wrong_requests(
    factory_here: Factory,
    box_room: Path,
    tmp_path: Path,
    scene: str,
    radio: str,
    more: list[str],
    words: list[str],
) -> None:
    (tmp_path / "text.blend").write_text("this is a letter, no Blender file")
    target = str(tmp_path / scene) if scene.endswith(".blend") else scene
    target = str(box_room) if scene == "room" else target
    out = str(tmp_path / "out")
    line = one_line(factory_here("generate", target, "--radio", radio, "--out", out, *more))
    assert all(word in line for word in words), line


def test_a_plan_refuses_what_generate_refuses(
    factory_here: Factory, box_room: Path, tiny_copy: Path, tmp_path: Path
) -> None:
    """Whoever plans a night of tracing shall not learn in the evening that it cannot be."""
    (tmp_path / "file").write_text("a letter")
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    for radio, out, more, words in (
        ("mmwave", "out", WIDE, "reach 56.3 m"),
        ("wifi", "file", (), "a file of that name exists"),
        ("wifi", tiny_copy.name, (), "was made with scene = 'tiny'"),
    ):
        asked = (str(box_room), "--radio", radio, "--out", str(tmp_path / out), *more)
        refusals = [one_line(factory_here(command, *asked)) for command in ("plan", "generate")]
        assert refusals[0] == refusals[1] and words in refusals[0]
    assert before == {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}


def test_packets_that_no_radio_sends_are_refused_by_check_too(factory_here: Factory) -> None:
    answer = factory_here("check", "living_room_walk", "--packets-per-frame", "0")
    assert "--packets-per-frame 0: expected 1 to 10000" in one_line(answer)


def test_a_gpu_that_is_not_there_is_refused_before_anything_is_made(
    factory: Factory, tmp_path: Path
) -> None:
    from dataset_factory.trace.setup import prepare

    try:
        prepare(device="cuda")
    except MissingToolError:
        made = tmp_path / "made"
        answer = factory("generate", "gestures", "--device", "cuda", "--out", str(made))
        assert "--device cuda" in one_line(answer) and "--device cpu" in answer.stderr
        assert not made.exists()
    else:
        pytest.skip("this machine has a GPU")


def test_a_benchmark_of_too_few_frames_is_refused_before_they_are_made(
    factory_here: Factory,
) -> None:
    answer = factory_here("bench", "living_room_walk", "--frames", "10:40:5")
    assert "--frames 10:40:5: expected at least 8 frames" in one_line(answer)
    assert answer.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("scene", "words"),
    [
        ({"moving": False}, ["no moving mesh"]),
        ({"wall": "floorboard"}, ["'floorboard'", "50 to 100 GHz", "5.72 to 5.88 GHz", "choose"]),
        ({"scale": 0.1}, ["0.17 m", "unit scale"]),
        ({"scale": 0.26}, ["a person of 0.442 m, expected 0.5 to 5 m", "unit scale"]),
    ],
)
def test_unsuitable_scenes(
    factory_here: Factory, build_scene: BuildScene, tmp_path: Path, scene: dict, words: list[str]
) -> None:
    out = tmp_path / "out"
    blend = str(build_scene(**scene))
    line = one_line(factory_here("generate", blend, "--radio", "wifi", "--out", str(out)))
    assert all(word in line for word in words), line
    assert not out.exists(), "nothing is left"


def test_missing_and_old_llvm(factory: Factory, box_room: Path, tmp_path: Path) -> None:
    arguments = ["generate", str(box_room), "--radio", "wifi", "--out", str(tmp_path / "out")]
    line = one_line(factory(*arguments, DRJIT_LIBLLVM_PATH=str(tmp_path / "libLLVM.so")))
    assert "no LLVM" in line and "libllvm19" in line


@pytest.mark.parametrize(
    "command",
    [
        ("generate", "living_room_walk", "--radio", "wifi"),
        ("plan", "living_room_walk", "--radio", "wifi"),
        ("convert", "data", "--to", "mat"),
        ("preview", "data"),
    ],
)
def test_a_place_that_cannot_be_made_is_refused_first(
    factory_here: Factory, tmp_path: Path, command: tuple[str, ...]
) -> None:
    (tmp_path / "file").write_text("")
    # Not even the administrator makes a folder in the second.
    for place in (tmp_path / "file" / "below", Path("/proc/rfgs")):
        line = one_line(factory_here(*command, "--out", str(place)))
        assert line.startswith(f"error: {place}: nothing can be made there (")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_truncated_chunk_is_named(factory_here: Factory, box_copy: Path) -> None:
    file = chunk_file(box_copy / "box_room/radio/wifi/csi.zarr", 1)
    file.write_bytes(file.read_bytes()[:100])
    answer = factory_here("validate", str(box_copy))
    assert answer.returncode == 1
    assert f"fault: {file}: truncated" in answer.stdout
    assert str(file) in one_line(factory_here("preview", str(box_copy)))


def test_ambiguous_sequence(factory_here: Factory, box_copy: Path) -> None:
    from dataclasses import replace

    from rfgs_core.dataset import open_dataset
    from rfgs_core.dataset.writer import finish_dataset

    (box_copy / "box_room").rename(box_copy / "one")
    finish_dataset(box_copy, replace(open_dataset(box_copy).info, sequences=["one", "two"]))
    assert "ambiguous sequence: it holds one, two" in one_line(
        factory_here("preview", str(box_copy))
    )


def test_full_disk(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    box_room: Path,
    tmp_path: Path,
) -> None:
    def full(*_args: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device", "csi.zarr")

    monkeypatch.setattr("dataset_factory.make.generate.write_json", full)
    command = ["generate", str(box_room), "--radio", "wifi", "--out", str(tmp_path / "out")]
    assert cli.main(command) == 2
    assert "error: the disk is full while writing csi.zarr" in capsys.readouterr().err


def test_frames_are_grouped_into_runs() -> None:
    assert frame_runs([]) == []
    assert frame_runs([4]) == ["4:4:1"]
    frames = [1, 2, 3, 7, 10, 13, 14]
    runs = frame_runs(frames)
    assert [frame for run in runs for frame in parse_frames(run)] == frames and len(runs) == 3
