# SPDX-License-Identifier: Apache-2.0
"""`rfgs view`: a run in the browser."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from rfgs_core.view.selection import ColorMode, Layer

if TYPE_CHECKING:
    from rfgs_core.run import Run
    from rfgs_core.view.page_server import PageServer
    from rfgs_core.view.viewer import Viewer


@dataclass(frozen=True)
class ViewArgs:
    """Shows a run in the web browser: Gaussians over time beside the truth and the radios.

    Prints an address to open; Ctrl-C ends it. The page needs no internet. It plays the Gaussians
    of all frames as points (coloured by distance to the true surface, reflected power, phase of
    the reflectivity, or display RGB), over a thin outline of the true surface, in the room with
    antennas, boresights and links, and what a camera of the dataset sees, rendered beside true.
    A run that is still being trained shows its finished frames, and more as they are finished.
    """

    run: tyro.conf.Positional[Path | None] = None
    """Folder of a trained run."""
    example: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    """Show the small run that comes with the package: nothing has to be made before."""
    host: str = "127.0.0.1"
    """Address to listen at: this machine only; 0.0.0.0 lets everybody in its network look."""
    port: int = 8080
    """Port to listen at; 0 takes any free one."""
    open: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    """Open the page in this machine's browser."""
    frame: int | None = None
    """Frame to begin with; the first of the run if not given."""
    color: ColorMode | None = None
    """Colours to begin with; if not given, error (distance to the true surface) where that is
    known, else power."""
    show: tyro.conf.UseAppendAction[tuple[Layer, ...]] = ()
    """Also show links, ray paths, coverage or cameras from the beginning; repeat the option for
    several."""
    play: bool = True
    """Let frames follow each other from the beginning."""
    wait: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    """Wait for the first fitted frame of a run in training, instead of refusing one without."""
    picture: Path | None = None
    """Write a picture of the page to this .png with a headless Chromium, and end."""
    width: int = 1280
    """Width of that picture [px]; 420 is what a phone shows."""
    record: Path | None = None
    """Write a video to this .mp4 (by ffmpeg) or .webp with a headless Chromium, and
    end: all frames in their own time, seen by a camera that swings around the people."""


def run(args: ViewArgs) -> int:
    """Serves the page until Ctrl-C; exit code 0."""
    from rfgs_core.errors import RfgsError
    from rfgs_core.example import chosen_run
    from rfgs_core.run import open_run
    from rfgs_core.video import check_video
    from rfgs_core.view.browser import find_chromium
    from rfgs_core.view.recording import record
    from rfgs_core.view.server import running_server
    from rfgs_core.view.snapshot import NARROWEST_PX, WIDEST_PX, take_picture
    from rfgs_core.view.viewer import Viewer

    if args.picture is not None and args.picture.suffix.lower() != ".png":
        raise RfgsError(f"{args.picture}: expected a file name ending in .png")
    if not NARROWEST_PX <= args.width <= WIDEST_PX:
        raise RfgsError(f"--width {args.width}: expected {NARROWEST_PX} to {WIDEST_PX} pixels")
    if args.record is not None:
        check_video(args.record)
    files = [file for file in (args.picture, args.record) if file is not None]
    if files:
        find_chromium()
    path = chosen_run(args.run, args.example)
    trained = _first_frame(path) if args.wait else open_run(path)
    # Only the own browser asks for a page that is drawn: no viewer that is open is in its way.
    host, port = ("127.0.0.1", 0) if files else (args.host, args.port)
    with running_server(host, port) as server:
        viewer = Viewer(
            trained, server, args.frame, args.color, args.show, play=args.play and not files
        )
        if not files:
            return _serve(viewer, server, args.open)
        sys.stderr.write("drawing the page; a minute or two without a GPU\n")
        if args.picture is not None:
            take_picture(server, args.picture, args.width)
        if args.record is not None:
            record(viewer, server, args.record)
    for file in files:
        sys.stdout.write(f"{file} written\n")
    return 0


def _first_frame(path: Path) -> Run:
    """A run, as soon as a frame of it is fitted."""
    import time

    from rfgs_core.run import open_run
    from rfgs_core.run.config import CONFIG_FILE, HEAD_FILE

    while not (path / CONFIG_FILE).is_file() or not (path / HEAD_FILE).is_file():
        time.sleep(0.5)
    return open_run(path)


def _serve(viewer: Viewer, server: PageServer, open_page: bool) -> int:
    import os
    import webbrowser

    from rfgs_core.interrupts import CALLED
    from rfgs_core.view.server import address

    where = address(server)
    # Ctrl-C counts from the first word on: whoever reads it may answer at once.
    try:
        called = bool(os.environ.get(CALLED))
        # The bar of a training that is watched stands on a line of its own.
        sys.stderr.write("\n" if called else "")
        ends = "ends with the training" if called else "Ctrl-C ends"
        sys.stdout.write(f"{where} shows the run; {ends}\n")
        sys.stdout.flush()
        if open_page and not webbrowser.open(where):
            sys.stderr.write("no browser was found; open the address yourself\n")
        viewer.follow()
    except KeyboardInterrupt:
        sys.stderr.write("\nthe viewer has ended\n")
    return 0
