# SPDX-License-Identifier: Apache-2.0
"""The page over real sockets: served, followed by a client, refused where it cannot be."""

from __future__ import annotations

import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from known_run import write_run
from viser_client import Client, connected

from rfgs_core.cli import main
from rfgs_core.errors import MissingToolError, RfgsError
from rfgs_core.run import Run, open_run
from rfgs_core.view.browser import find_chromium
from rfgs_core.view.colors import TITLES
from rfgs_core.view.server import address, running_server
from rfgs_core.view.viewer import Viewer

ROOT = Path(__file__).resolve().parents[3]
LIMIT_S = 20.0
ALL = 179
"""Gaussians of the run: 3 static ones and one per vertex of the sphere."""


@pytest.fixture(scope="module")
def page(known_run: Run) -> Iterator[tuple[Viewer, Client]]:
    """A viewer and a client that has received everything."""
    with running_server("127.0.0.1", 0) as server:
        viewer = Viewer(known_run, server, mode="display")
        with connected(server) as client:
            client.read(lambda: "/points" in client.nodes and "Camera" in client.controls)
            yield viewer, client


def change(page: tuple[Viewer, Client], **chosen: object) -> None:
    """Moves controls from the client's side and lets the viewer follow."""
    viewer, client = page
    for label, value in chosen.items():
        begin = time.monotonic()
        client.choose(label.replace("_", " "), value)
        viewer.step(limit_s=LIMIT_S)
        assert time.monotonic() - begin < LIMIT_S, f"{label}: nobody told the viewer"


def test_layers_are_drawn_when_they_are_asked_for(page: tuple[Viewer, Client]) -> None:
    _, client = page
    assert not {"/rays", "/coverage"} & set(client.nodes)
    change(page, Ray_paths=True, Coverage=True)
    client.read(lambda: {"/rays", "/coverage"} <= set(client.nodes))
    change(page, Ray_paths=False, Coverage=False)
    client.read(lambda: client.nodes["/rays"]["visible"] is False)


@pytest.fixture
def foggy(page: tuple[Viewer, Client]) -> Iterator[tuple[Viewer, Client]]:
    """The same with splats, which say exactly what each Gaussian is."""
    change(page, Draw_as="splats")
    page[1].read(lambda: "/splats" in page[1].nodes)
    yield page
    change(page, Draw_as="points")
    page[1].read(lambda: "/splats" not in page[1].nodes)


def splats(client: Client) -> np.ndarray:
    """Rows of eight 32-bit words: centre, nothing, covariance, colour."""
    return client.nodes["/splats"]["buffer"].reshape(-1, 8)


def centres_m(client: Client) -> np.ndarray:
    return splats(client)[:, :3].copy().view(np.float32)


def test_a_client_receives_gaussians_truth_room_and_radio(
    foggy: tuple[Viewer, Client], known_run: Run
) -> None:
    _, client = foggy
    np.testing.assert_array_equal(centres_m(client), known_run.gaussians(1).means.numpy())
    vertices, _, _ = known_run.sequence.moving_mesh(1)
    np.testing.assert_array_equal(client.nodes["/truth/surface"]["vertices"], vertices.ravel())
    assert len(client.nodes["/room/edges"]["points"]) == 12 * 2 * 3
    elements = known_run.sequence.layout("wifi")
    for name, places in (("tx", elements.tx_xyz), ("rx", elements.rx_xyz)):
        points = client.nodes[f"/radios/{name}"]["points"].reshape(-1, 3)
        np.testing.assert_array_equal(points, places.astype(np.float32))
    assert len(client.nodes["/links"]["points"]) == 12 * 2 * 3
    assert {f"/cameras/cam0{index}" for index in range(4)} <= set(client.nodes)
    # A run without limbs has nothing to say of how sure they are.
    known = [title for mode, title in TITLES.items() if mode != "sigma"]
    assert client.controls["Colour by"]["options"] == known


def test_the_slider_changes_the_frame(foggy: tuple[Viewer, Client], known_run: Run) -> None:
    page, client = foggy, foggy[1]
    change(page, Frame=2)
    wanted = known_run.gaussians(2).means.numpy()
    client.read(lambda: np.array_equal(centres_m(client), wanted))
    true = known_run.sequence.moving_mesh(2)[0].ravel()
    client.read(lambda: np.array_equal(client.nodes["/truth/surface"]["vertices"], true))
    change(page, Frame=1)


def test_colours_follow_the_mode(foggy: tuple[Viewer, Client]) -> None:
    page, client = foggy, foggy[1]
    before = splats(client)[:, 7].copy()
    change(page, Colour_by=TITLES["power"])
    client.read(lambda: not np.array_equal(splats(client)[:, 7], before))
    rgba = splats(client)[:, 7].copy().view(np.uint8).reshape(-1, 4)
    # The static ones have no power; viridis begins violet and ends yellow.
    assert (np.ptp(rgba[:3, :3], axis=1) == 0).all()
    assert rgba[3, 2] > rgba[3, 1] and rgba[-1, 0] > 240 and rgba[-1, 2] < 60
    legend = client.labelled("GuiHtmlMessage")[0]
    client.read(lambda: "linear-gradient" in legend["content"])
    change(page, Colour_by=TITLES["display"])


def test_the_opacity_threshold_hides_gaussians_and_says_so(foggy: tuple[Viewer, Client]) -> None:
    page, client = foggy, foggy[1]
    change(page, Opacity_from=0.5)
    opacities = np.concatenate([np.full(3, 0.9), np.linspace(0.1, 0.8, ALL - 3)])
    left = int((opacities >= 0.5).sum())
    client.read(lambda: len(splats(client)) == left)
    shown = [row for row in client.labelled("GuiMarkdownMessage") if "Gaussians" in str(row)]
    client.read(lambda: f"{left} of {ALL} Gaussians" in str(shown[0]))
    change(page, Opacity_from=0.0)


def test_power_within_so_many_decibels_of_the_strongest(foggy: tuple[Viewer, Client]) -> None:
    page, client = foggy, foggy[1]
    change(page, **{"Power within [dB]": 10.0})
    strong = int((np.linspace(-90, -60, ALL - 3) >= -70.0).sum()) + 3
    client.read(lambda: len(splats(client)) == strong)
    change(page, **{"Power within [dB]": 60.0})
    client.read(lambda: len(splats(client)) == ALL)


def test_points_replace_splats_and_back(page: tuple[Viewer, Client]) -> None:
    _, client = page
    change(page, Draw_as="splats")
    client.read(lambda: "/splats" in client.nodes and "/points" not in client.nodes)
    change(page, Draw_as="points")
    client.read(lambda: "/points" in client.nodes and "/splats" not in client.nodes)
    assert len(client.nodes["/points"]["points"]) == 3 * ALL


def test_ticks_show_and_hide(page: tuple[Viewer, Client], known_run: Run) -> None:
    _, client = page
    change(page, Ground_truth="hidden", Links=True)
    truth = [f"/truth/{name}" for name in ("outline", "surface", "name")]
    seen = lambda: [client.nodes[name]["visible"] for name in truth]  # noqa: E731
    client.read(lambda: seen() == [False, False, False] and client.nodes["/links"]["visible"])
    # What is hidden stays so when the frame changes.
    change(page, Frame=2)
    centre = known_run.sequence.moving_mesh(2)[0].mean(axis=0)
    moved = lambda: client.nodes["/truth/surface"]["vertices"].reshape(-1, 3).mean(axis=0)  # noqa: E731
    client.read(lambda: np.allclose(moved(), centre, atol=1e-4))
    client.read(lambda: seen() == [False, False, False])
    change(page, Ground_truth="shaded surface")
    client.read(lambda: seen() == [False, True, True])
    change(page, Ground_truth="thin outline", Links=False, Frame=1)
    client.read(lambda: seen() == [True, False, True])


def test_playing_moves_to_the_next_frame_and_round(page: tuple[Viewer, Client]) -> None:
    viewer, _ = page
    change(page, Play=True)
    frames = [viewer.panel.selection().frame]
    for _ in range(60):
        viewer.step()
        if viewer.panel.selection().frame != frames[-1]:
            frames.append(viewer.panel.selection().frame)
        if len(frames) == 4:
            break
    change(page, Play=False)
    assert frames in ([1, 2, 1, 2], [2, 1, 2, 1])


def test_the_page_is_one_file_from_this_machine(page: tuple[Viewer, Client]) -> None:
    viewer, _ = page
    with urllib.request.urlopen(address(viewer.server), timeout=10) as answer:
        assert answer.status == 200
        text = answer.read().decode("utf-8", "replace")
    assert not re.findall(r"""(?:src|href)=["']?https?://""", text)


def test_what_a_capture_does_not_hold_is_not_offered(tiny_dataset: Path, tmp_path: Path) -> None:
    data = tmp_path / "capture"
    shutil.copytree(tiny_dataset, data)
    for name in ("geometry", "images", "images_empty"):
        shutil.rmtree(data / "tiny" / name)
    run = open_run(write_run(tmp_path / "run", tiny_dataset, data))
    with running_server("127.0.0.1", 0) as server:
        viewer = Viewer(run, server)
        assert list(viewer.scales) == ["display", "power", "phase"]
        with connected(server) as client:
            client.read(lambda: "/points" in client.nodes and "Cameras" in client.controls)
            client.read(lambda: "no true picture" in str(client.labelled("GuiMarkdownMessage")))
        assert not {"/truth/outline", "/truth/name", "/room/edges"} & set(client.nodes)
        assert client.controls["Ground truth"]["disabled"]
        assert viewer.panel.selection().mode == "power", "the next best to the unknown error"
        with pytest.raises(RfgsError, match="nothing to colour by error; expected one of display"):
            Viewer(run, server, mode="error")


def test_a_page_begins_with_errors_as_points_over_a_thin_named_outline(known_run: Run) -> None:
    with running_server("127.0.0.1", 0) as server:
        viewer = Viewer(known_run, server, play=True)
        selection = viewer.panel.selection()
        assert (selection.mode, selection.drawn_as, selection.truth) == (
            "error",
            "points",
            "outline",
        )
        assert viewer.panel.playing
        with connected(server) as client:
            client.read(lambda: "/points" in client.nodes and "Camera" in client.controls)
            client.read(lambda: not client.nodes["/truth/surface"]["visible"])
            assert client.nodes["/truth/name"]["text"] == "outline: ground truth"
            assert client.controls["Skeletons"]["disabled"]


def test_a_taken_port_is_one_line(known_run: Run, capsys: pytest.CaptureFixture[str]) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        assert main(["view", str(known_run.path), "--port", str(port)]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert err.startswith(f"error: port {port} of 127.0.0.1 is in use; ")


@pytest.mark.parametrize(
    ("host", "port", "message"),
    [
        ("127.0.0.1", 70000, "--port 70000: expected 0 to 65535"),
        ("192.0.2.1", 0, "--host 192.0.2.1: not an address of this machine"),
        ("no such host", 0, "--host no such host: not an address of this machine"),
    ],
)
def test_addresses_that_cannot_be(host: str, port: int, message: str) -> None:
    with pytest.raises(RfgsError, match=message):
        running_server(host, port).__enter__()


def test_the_port_is_free_again_afterwards(capsys: pytest.CaptureFixture[str]) -> None:
    with running_server("127.0.0.1", 0) as server:
        port = server.get_port()
    with running_server("127.0.0.1", port) as server:
        assert server.get_port() == port
    assert capsys.readouterr() == ("", "")


def error_line(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    assert main(["view", *arguments]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    return err


def test_wrong_runs_are_one_line(
    known_run: Run, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "is not a run" in error_line([str(tmp_path), "--port", "0"], capsys)
    run = [str(known_run.path), "--port", "0"]
    assert "no frame 7; it has 1, 2" in error_line([*run, "--frame", "7"], capsys)
    assert "name ending in .png" in error_line([*run, "--picture", "page.jpg"], capsys)
    broken = tmp_path / "run"
    shutil.copytree(known_run.path, broken)
    (broken / "gaussians/000001.ply").write_text("ply")
    open_run(broken).with_dataset(known_run.path / known_run.config.dataset)
    assert "000001.ply" in error_line([str(broken), "--port", "0"], capsys)


def test_without_chromium_the_picture_names_the_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "playwright", ModuleType("playwright"))
    monkeypatch.setenv("PATH", "")
    with pytest.raises(MissingToolError, match="apt-get install -y chromium"):
        find_chromium()
    monkeypatch.setitem(sys.modules, "playwright", None)
    with pytest.raises(MissingToolError, match=r"pip install 'rfgs\[picture\]'"):
        find_chromium()


def test_ctrl_c_ends_the_program_with_one_line(known_run: Run) -> None:
    process = subprocess.Popen(
        [sys.executable, "-m", "rfgs_core.cli", "view", str(known_run.path), "--port", "0"],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    line = process.stdout.readline()
    found = re.fullmatch(r"(http://127\.0\.0\.1:\d+/[\w-]{22}) shows the run; Ctrl-C ends\n", line)
    assert found is not None, line
    with urllib.request.urlopen(found[1], timeout=10) as answer:
        assert answer.status == 200
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert (process.returncode, out) == (0, "")
    # On a busy machine a progress bar may stand before it.
    assert err.endswith("\nthe viewer has ended\n") and "Traceback" not in err
