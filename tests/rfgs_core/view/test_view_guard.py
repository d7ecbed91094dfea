# SPDX-License-Identifier: Apache-2.0
"""The viewer under attack: foreign pages, wrong values, junk and clients that vanish."""

from __future__ import annotations

import http.client
import random
import socket
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from urllib.parse import urlsplit

import msgspec
import pytest
from known_run import write_run
from viser_client import Client, connected, opened
from websockets.exceptions import InvalidStatus

from rfgs_core.run import Run
from rfgs_core.view.guard import Faults
from rfgs_core.view.messages import complaint
from rfgs_core.view.server import address, running_server
from rfgs_core.view.viewer import Viewer


@pytest.fixture(scope="module")
def viewer(known_run: Run) -> Iterator[Viewer]:
    with running_server("127.0.0.1", 0) as server:
        yield Viewer(known_run, server)


@pytest.fixture
def fresh(known_run: Run) -> Iterator[Viewer]:
    """A viewer that has told no fault yet."""
    with running_server("127.0.0.1", 0) as server:
        yield Viewer(known_run, server)


def toggle(viewer: Viewer, client: Client, label: str) -> None:
    """Ticks a control and waits until the viewer has heard of it."""
    before = viewer.panel.selection()
    client.choose(label, not getattr(before, label.lower()))
    end = time.monotonic() + 20.0
    while not viewer.panel.selection().differs(before, label.lower()):
        assert time.monotonic() < end, "nobody told the viewer"
        viewer.step(limit_s=0.5)


def answers(viewer: Viewer) -> None:
    """A client that comes now receives the scene and is heard."""
    with connected(viewer.server) as client:
        client.read(lambda: "/points" in client.nodes and "Camera" in client.controls)
        toggle(viewer, client, "Room")
        toggle(viewer, client, "Room")


def status(viewer: Viewer, path: str, host: str | None = None) -> int:
    place = urlsplit(address(viewer.server))
    connection = http.client.HTTPConnection(place.netloc, timeout=10)
    connection.request("GET", path, headers={"Host": host or place.netloc})
    answer = connection.getresponse()
    assert answer.status != 200 or answer.headers["Referrer-Policy"] == "no-referrer"
    return answer.status


def test_a_foreign_origin_is_refused_and_told_once(
    fresh: Viewer, caplog: pytest.LogCaptureFixture
) -> None:
    where = address(fresh.server)
    for _ in range(5):
        with pytest.raises(InvalidStatus, match="403"):
            opened(where, Origin="https://evil.example")
    assert len(caplog.records) == 1
    assert "expected a page of this server as Origin" in caplog.text
    assert "https://evil.example" in caplog.text
    # The page's own origin is the address that it was opened at.
    with opened(where, Origin=where.rpartition("/")[0]) as own:
        assert own.recv(timeout=10)
    # So is another server of this machine: a foreign one.
    with pytest.raises(InvalidStatus, match="403"):
        opened(where, Origin="http://127.0.0.1:9")
    answers(fresh)


def test_a_foreign_host_or_no_token_is_refused(viewer: Viewer) -> None:
    place = urlsplit(address(viewer.server))
    assert status(viewer, place.path) == 200
    assert status(viewer, f"{place.path}/?websocket=ws://x") == 200
    assert status(viewer, place.path, f"localhost:{place.port}") == 200
    # A forwarded port is another one.
    assert status(viewer, place.path, "localhost:9000") == 200
    for host in ("evil.example", f"evil.example:{place.port}", "127.0.0.1.evil.example", "[", "a@"):
        assert status(viewer, place.path, host) == 403
    for path in ("/", "/index.html", place.path[:-1], f"{place.path}/x", f"{place.path}%00"):
        assert status(viewer, path) == 403
    with pytest.raises(InvalidStatus, match="403"):
        opened(f"http://{place.netloc}")


def test_everywhere_means_numbers_and_the_own_name(known_run: Run) -> None:
    with running_server("0.0.0.0", 0) as server:
        shown = Viewer(known_run, server)
        path = urlsplit(address(server)).path
        assert status(shown, path, "192.0.2.7:8080") == 200
        assert status(shown, path, socket.gethostname()) == 200
        assert status(shown, path, "evil.example") == 403


@pytest.mark.parametrize(
    ("label", "value"),
    [
        *(("Colour by", value) for value in ("no such mode", 3, None, ["display"], {})),
        *(("Frame", value) for value in (1e308, float("nan"), -1, 3, "2", None, True, [1], 2**63)),
        *(("Brightness", value) for value in (float("inf"), 0.0, -5.0)),
        *(("Room", value) for value in (2, "yes", None, [])),
        *(("Camera", value) for value in ("../../etc", 0)),
    ],
)
def test_values_that_no_control_has_change_nothing(
    viewer: Viewer, label: str, value: object, caplog: pytest.LogCaptureFixture
) -> None:
    before = viewer.panel.selection()
    with connected(viewer.server) as client:
        client.read(lambda: label in client.controls)
        client.choose(label, value)
        toggle(viewer, client, "Links")
        assert not viewer.panel.selection().differs(before, "frame", "mode", "room", "camera")
        assert viewer.panel.selection().brightness == before.brightness
        assert caplog.text.count(label) <= 1
    answers(viewer)


def junk(random_state: random.Random, known: str) -> bytes | str:
    """A message that no page of ours sends."""
    update = {"type": "GuiUpdateMessage", "uuid": known}
    vector = (0.0, 0.0, float("nan"))
    camera = {"type": "ViewerCameraMessage", "wxyz": (1, 0, 0, 0), "position": vector}
    kinds: list[Callable[[], object]] = [
        lambda: random_state.randbytes(random_state.randrange(200)),
        lambda: "text",
        lambda: {"type": random_state.choice(["ShareUrlRequest", "RunJavascriptMessage", "x", 3])},
        lambda: {**update, "updates": {random_state.choice(["uuid", "_x", "order"]): 1}},
        lambda: {**update, "updates": {"value": {"a": random_state.random()}}},
        lambda: {**update, "updates": {}, "more": 1},
        lambda: camera,
        lambda: [[]] * random_state.randrange(50),
        lambda: {
            "type": "FileTransferStartUpload",
            "source_component_uuid": known,
            "part_count": 9,
        },
    ]
    value = random_state.choice(kinds)()
    return value if isinstance(value, bytes | str) else msgspec.msgpack.encode(value)


def test_a_thousand_junk_messages_and_it_still_answers(
    fresh: Viewer, caplog: pytest.LogCaptureFixture, capfd: pytest.CaptureFixture[str]
) -> None:
    state = random.Random(5)
    before = fresh.panel.selection()
    with connected(fresh.server) as client:
        client.read(lambda: "Room" in client.controls)
        for _ in range(1000):
            client.send(junk(state, client.controls["Room"]["uuid"]))
        toggle(fresh, client, "Room")
        toggle(fresh, client, "Room")
    answers(fresh)
    assert fresh.panel.selection() == before
    # One line per kind, and not more than a screen of them.
    assert 1 <= len(caplog.records) <= 25
    assert all(record.exc_info is None for record in caplog.records)
    assert "Traceback" not in "".join(capfd.readouterr())


@pytest.mark.parametrize(
    "wrong",
    [
        {"look_at": (0.0, 0.0, 3.0)},
        {"up_direction": (0.0, 0.0, 0.0)},
        {"wxyz": (0.0, 0.0, 0.0, 0.0)},
    ],
)
def test_a_camera_without_direction_is_dropped(
    fresh: Viewer, caplog: pytest.LogCaptureFixture, wrong: dict[str, tuple[float, ...]]
) -> None:
    camera = {
        "type": "ViewerCameraMessage",
        "wxyz": (1.0, 0.0, 0.0, 0.0), "position": (0.0, 0.0, 3.0), "fov": 1.0, "near": 0.1,
        "far": 100.0, "image_height": 480, "image_width": 640, "look_at": (0.0, 0.0, 0.0),
        "up_direction": (0.0, 1.0, 0.0),
    }  # fmt: skip
    controls = fresh.server.gui._gui_input_handle_from_uuid
    assert complaint(msgspec.msgpack.encode(camera), controls) == ""
    with opened(address(fresh.server)) as socket:
        socket.send(msgspec.msgpack.encode({**camera, **wrong}))
        answers(fresh)
    assert "expected a camera that looks somewhere" in caplog.text


def test_a_fault_of_a_callback_is_one_line(
    fresh: Viewer, caplog: pytest.LogCaptureFixture, capfd: pytest.CaptureFixture[str]
) -> None:
    def broken(_event: object) -> None:
        raise ValueError("no such place")

    control = fresh.server.gui.add_checkbox("Broken", False)
    control.on_update(broken)
    with connected(fresh.server) as client:
        client.read(lambda: "Broken" in client.controls)
        for value in (True, False, True):
            client.choose("Broken", value)
        answers(fresh)
    assert caplog.text.count("the viewer goes on after a fault: no such place") == 1
    assert "Traceback" not in "".join(capfd.readouterr())


def test_a_hundred_vanishing_clients_and_it_still_answers(
    fresh: Viewer, caplog: pytest.LogCaptureFixture, capfd: pytest.CaptureFixture[str]
) -> None:
    state, place = random.Random(6), urlsplit(address(fresh.server))
    for index in range(100):
        if index % 4 == 0:
            # Gone in the middle of a scene, without a farewell.
            page = opened(address(fresh.server))
            Client(page).look()
            page.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
            page.socket.close()
            continue
        with socket.create_connection(("127.0.0.1", place.port or 0), timeout=10) as raw:
            if index % 4 == 1:
                raw.sendall(state.randbytes(300))
            elif index % 4 == 2:
                raw.sendall(f"GET {place.path} HTTP/1.1\r\nHost: {place.netloc}\r\n".encode())
    answers(fresh)
    assert len(caplog.records) <= 25
    assert all(record.exc_info is None for record in caplog.records)
    assert "Traceback" not in "".join(capfd.readouterr())


def test_a_message_larger_than_any_of_the_page_ends_only_its_connection(viewer: Viewer) -> None:
    with connected(viewer.server) as client:
        client.send(bytes(2**20))
    answers(viewer)


def test_a_frame_that_breaks_meanwhile_is_one_line(
    tiny_dataset: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    from rfgs_core.run import open_run

    run = open_run(write_run(tmp_path / "run", tiny_dataset))
    with running_server("127.0.0.1", 0) as server:
        shown = Viewer(run, server)
        shown.frames.read.cache_clear()
        run.ply_path(2).write_text("ply")
        shown.panel.set("frame", 2)
        steps = iter([shown.step])

        def step(limit_s: float | None = None) -> None:
            following = next(steps, None)
            if following is None:
                raise KeyboardInterrupt
            following(0.1)

        shown.step = step  # type: ignore[method-assign]
        with pytest.raises(KeyboardInterrupt):
            shown.follow()
    assert caplog.text.count("000002.ply") == 1


def test_the_log_has_no_control_sequences(caplog: pytest.LogCaptureFixture) -> None:
    Faults().tell("expected this, found \x1b[2J" + "x" * 1000)
    assert "found ?[2Jxx" in caplog.text
    assert len(caplog.messages[0]) == 200
