# SPDX-License-Identifier: Apache-2.0
"""Gaussians of `rfgs live` as a cloud; `test_inside_blender.py` runs this file.

$RFGS_DATASET is a dataset to replay and $RFGS_PYTHON a Python that has rfgs.
"""

from __future__ import annotations

import json
import os
import re
import socket
import subprocess
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from blank_file import open_blank_file

from addon_rfgs.cli import run
from addon_rfgs.errors import AddonError
from addon_rfgs.gaussians import attributes
from addon_rfgs.live import following
from addon_rfgs.live.feed import LONGEST_HEAD, MOST_GAUSSIANS, NEEDED, Feed

DATASET, PYTHON = os.environ["RFGS_DATASET"], os.environ["RFGS_PYTHON"]


@pytest.fixture
def said(registered: None) -> Iterator[Any]:
    """Settings of an empty scene; nothing is followed afterwards."""
    open_blank_file()
    yield bpy.context.scene.rfgs.live
    following.end()


def rows_of(count: int, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    rows = rng.uniform(0.1, 0.9, (count, len(NEEDED))).astype("<f4")
    rows[:, -1] = -40.0 * rng.random(count)
    return rows


def message(rows: np.ndarray, **changed: Any) -> bytes:
    """An update as `rfgs live` sends it, or with a head that says something else."""
    data = rows.tobytes()
    head = {"rfgs": 1, "time_s": 2.5, "count": len(rows), "columns": list(NEEDED)}
    return json.dumps(head | {"bytes": len(data)} | changed).encode() + b"\n" + data


class Sender:
    """A socket of this machine whose one reader is sent whatever is given."""

    def __init__(self) -> None:
        self._server = socket.create_server(("127.0.0.1", 0))
        self.port = self._server.getsockname()[1]
        self._reader: socket.socket | None = None

    def send(self, data: bytes) -> None:
        if self._reader is None:
            self._reader, _ = self._server.accept()
        self._reader.sendall(data)

    def close(self) -> None:
        for each in (self._reader, self._server):
            if each is not None:
                each.close()
        self._reader = None


@pytest.fixture
def sender() -> Iterator[Sender]:
    sender = Sender()
    yield sender
    sender.close()


def step_until(done: Any, patience_s: float = 10.0) -> None:
    """Ticks as Blender's timer would, for it has no loop here."""
    until = time.monotonic() + patience_s
    while not done():
        assert time.monotonic() < until, following.told()
        following._tick()
        time.sleep(0.01)


def test_a_replayed_dataset_moves_the_cloud(said: Any) -> None:
    command = [PYTHON, "-m", "rfgs_core.cli", "live", "--replay", DATASET, "--rate", "0.05"]
    command += ["--no-view", "--whole-fit-s", "0", "--gaussians", "40", "--feed-port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as live:
        try:
            assert live.stdout is not None
            lines = iter(live.stdout.readline, "")
            said.port = next(int(at[1]) for row in lines if (at := re.search(r"port (\d+)", row)))
            assert bpy.ops.rfgs.follow_live(updates=1) == {"FINISHED"}
            item = bpy.data.objects["Gaussians live"]
            assert len(item.data.vertices) == 40
            low, high = np.array([[0, 0, 0], [4.0, 3.5, 2.5]])
            middle = attributes.positions(item.data).mean(axis=0)
            assert (low < middle).all() and (middle < high).all()
            assert np.isfinite(attributes.get(item.data, "rf_power_db")).all()
            assert "rfgs_color" in item.data.attributes
        finally:
            live.terminate()


def test_the_cloud_is_what_was_sent(said: Any, sender: Sender, tmp_path: Path) -> None:
    rows = rows_of(30)
    following.begin(bpy.context.scene, sender.port)
    sender.send(message(rows_of(5)) + message(rows))
    step_until(lambda: following._now is not None and following._now.count == 30)
    mesh = bpy.data.objects["Gaussians live"].data
    np.testing.assert_array_equal(attributes.positions(mesh), rows[:, :3])
    np.testing.assert_array_equal(attributes.get(mesh, "scale"), rows[:, 3:6])
    np.testing.assert_allclose(attributes.get(mesh, "opacity"), rows[:, 10], rtol=1e-6)
    np.testing.assert_array_equal(attributes.get(mesh, "rf_power_db"), rows[:, 11])
    assert following.told().startswith("30 Gaussians, ")
    # In pieces, and with another number of Gaussians; no mesh is left over.
    data = message(rows_of(7, seed=1))
    for part in (data[:10], data[10:150], data[150:]):
        sender.send(part)
        following._tick()
    step_until(lambda: len(bpy.data.objects["Gaussians live"].data.vertices) == 7)
    assert len(bpy.data.meshes) == 1
    # What was shown last can be exported like any import.
    assert bpy.ops.rfgs.export_gaussians(filepath=str(tmp_path / "live.ply")) == {"FINISHED"}
    bpy.ops.rfgs.remove_data()
    assert not bpy.data.objects and not bpy.data.meshes and not bpy.data.node_groups
    sender.send(message(rows))
    step_until(lambda: not following.following())
    assert following.told() == "the live cloud was removed"


def test_rows_that_are_no_numbers_are_left_out_and_counted(said: Any, sender: Sender) -> None:
    rows = rows_of(9)
    rows[0, 0], rows[1, 4], rows[2, 11], rows[3, 6:10], rows[4, 3] = np.nan, np.inf, np.nan, 0, -1
    rows[5, 1] = 1e30
    following.begin(bpy.context.scene, sender.port)
    sender.send(message(rows))
    step_until(lambda: following._now is not None and following._now.updates == 1)
    assert len(bpy.data.objects["Gaussians live"].data.vertices) == 3
    assert "6 left out" in following.told()
    sender.send(message(rows[:0]))
    step_until(lambda: following._now is not None and following._now.count == 0)


def test_a_lost_connection_is_one_line(said: Any, sender: Sender) -> None:
    following.begin(bpy.context.scene, sender.port)
    assert not bpy.ops.rfgs.follow_live.poll() and bpy.ops.rfgs.stop_live.poll()
    sender.send(message(rows_of(3)) + b'{"rfgs": 1')
    step_until(lambda: following._now is not None and following._now.updates == 1)
    sender.close()
    step_until(lambda: not following.following())
    assert re.fullmatch(r"the feed at 127\.0\.0\.1, TCP port \d+ has ended; .*", following.told())
    assert not bpy.app.timers.is_registered(following._tick)
    # The cloud stays, and the next one takes its place.
    assert len(bpy.data.objects["Gaussians live"].data.vertices) == 3
    said.port = sender.port
    with pytest.raises(RuntimeError, match="nobody sends at") as caught:
        bpy.ops.rfgs.follow_live(updates=1)
    assert len(str(caught.value).strip().splitlines()) == 1
    assert len(bpy.data.objects) == 1


def test_stopping_leaves_the_cloud(said: Any, sender: Sender) -> None:
    following.begin(bpy.context.scene, sender.port)
    sender.send(message(rows_of(3)))
    step_until(lambda: following._now is not None and following._now.updates == 1)
    assert bpy.ops.rfgs.stop_live() == {"FINISHED"}
    assert following.told().startswith("Stopped: 3 Gaussians")
    assert not bpy.ops.rfgs.stop_live.poll()
    assert len(bpy.data.objects["Gaussians live"].data.vertices) == 3


SENSELESS = {
    "http": b"HTTP/1.1 200 OK\r\n\r\n",
    "endless": b"x" * (LONGEST_HEAD + 1),
    "nested": b"[" * 4000 + b"\n",
    "newer": message(rows_of(1), rfgs=2),
    "list": b"[1]\n",
    "many": message(rows_of(1), count=MOST_GAUSSIANS + 1),
    "huge": message(rows_of(1), count=10**400),
    "negative": message(rows_of(1), count=-1),
    "true": message(rows_of(1), count=True),
    "bytes": message(rows_of(1), bytes=10**12),
    "wide": message(rows_of(1), columns=[f"c{n}" for n in range(65)]),
    "twice": message(rows_of(1), columns=["x", "x"]),
    "lacking": message(rows_of(1), columns=["x", "y", "z"]),
    "columns": message(rows_of(1), columns={"x": 1}),
    "binary": bytes(range(11, 256)) + b"\n",
}


@pytest.mark.parametrize("name", SENSELESS)
def test_senseless_data_ends_it_in_one_line(said: Any, sender: Sender, name: str) -> None:
    following.begin(bpy.context.scene, sender.port)
    sender.send(SENSELESS[name])
    step_until(lambda: not following.following())
    assert re.fullmatch(r"127.0.0.1, TCP port \d+ sends no updates of .*", following.told())
    assert len(following.told()) < 200


def test_damaged_streams_end_or_are_survived(registered: None) -> None:
    rng = np.random.default_rng(4)
    good = message(rows_of(20)) * 3
    for _ in range(60):
        data = bytearray(good)
        for place in rng.integers(len(data), size=rng.integers(1, 6)):
            data[place] = rng.integers(256)
        sender = Sender()
        feed = Feed(sender.port)
        try:
            sender.send(bytes(data[: rng.integers(1, len(data) + 1)]))
            sender.close()
            with pytest.raises(AddonError):
                for _ in range(1000):
                    update = feed.newest()
                    assert update is None or len(update.cloud) <= MOST_GAUSSIANS
                    time.sleep(0.001)
        finally:
            feed.close()


def test_a_flood_is_skipped_to_the_newest(said: Any, sender: Sender) -> None:
    following.begin(bpy.context.scene, sender.port)
    flood = b"".join(message(rows_of(1000, seed), time_s=float(seed)) for seed in range(40))
    thread = threading.Thread(target=sender.send, args=(flood,))
    thread.start()
    step_until(lambda: following._now is not None and following._now.time_s == 39.0)
    thread.join()
    assert following._now is not None and following._now.updates < 40


def test_the_command_saves_what_was_sent(
    said: Any, sender: Sender, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    thread = threading.Thread(target=sender.send, args=(message(rows_of(12)),))
    thread.start()
    out = tmp_path / "live.blend"
    assert run(["live", "--port", str(sender.port), "--out", str(out)]) == 0
    thread.join()
    assert "12 Gaussians, 1 updates in 0.0 s" in capfd.readouterr().out
    with bpy.data.libraries.load(str(out)) as (found, _):
        assert found.objects == ["Gaussians live"]


def test_silence_is_told(said: Any, sender: Sender, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(following, "PATIENCE_S", 0.2)
    said.port = sender.port
    with pytest.raises(RuntimeError, match="no update at TCP port"):
        bpy.ops.rfgs.follow_live(updates=1)
