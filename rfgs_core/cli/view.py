# SPDX-License-Identifier: Apache-2.0
"""`rfgs view`: a run in the browser."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from rfgs_core.view.selection import ColorMode

if TYPE_CHECKING:
    from rfgs_core.view.page_server import PageServer
    from rfgs_core.view.viewer import Viewer


@dataclass(frozen=True)
class ViewArgs:
    """Shows a run in the web browser: Gaussians over time beside the truth and the radios.

    Prints an address to open; Ctrl-C ends it. The page needs no internet. It shows the
    Gaussians of each frame (coloured by display RGB, reflected power, phase of the
    reflectivity, or distance to the true surface), the true surface, the room, antennas,
    boresights and links, and what a camera of the dataset sees, rendered beside true.
    A run that is still being trained shows its finished frames.
    """

    run: tyro.conf.Positional[Path]
    """Folder of a trained run."""
    host: str = "127.0.0.1"
    """Address to listen at: this machine only; 0.0.0.0 lets everybody in its network look."""
    port: int = 8080
    """Port to listen at; 0 takes any free one."""
    open: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False
    """Open the page in this machine's browser."""
    frame: int | None = None
    """Frame to begin with; the first of the run if not given."""
    color: ColorMode = "display"
    """Colours to begin with."""
    picture: Path | None = None
    """Write a picture of the page to this .png with a headless Chromium, and end."""


def run(args: ViewArgs) -> int:
    """Serves the page until Ctrl-C; exit code 0."""
    from rfgs_core.errors import RfgsError
    from rfgs_core.run import open_run
    from rfgs_core.view.browser import find_chromium
    from rfgs_core.view.server import running_server
    from rfgs_core.view.snapshot import take_picture
    from rfgs_core.view.viewer import Viewer

    if args.picture is not None:
        if args.picture.suffix.lower() != ".png":
            raise RfgsError(f"{args.picture}: expected a file name ending in .png")
        find_chromium()
    trained = open_run(args.run)
    with running_server(args.host, args.port) as server:
        viewer = Viewer(trained, server, args.frame, args.color)
        if args.picture is None:
            return _serve(viewer, server, args.open)
        sys.stderr.write("taking the picture; a minute or two without a GPU\n")
        take_picture(server, args.picture)
    sys.stdout.write(f"{args.picture} written\n")
    return 0


def _serve(viewer: Viewer, server: PageServer, open_page: bool) -> int:
    import webbrowser

    from rfgs_core.view.server import address

    where = address(server)
    # Ctrl-C counts from the first word on: whoever reads it may answer at once.
    try:
        sys.stdout.write(f"{where} shows the run; Ctrl-C ends\n")
        sys.stdout.flush()
        if open_page and not webbrowser.open(where):
            sys.stderr.write("no browser was found; open the address yourself\n")
        viewer.follow()
    except KeyboardInterrupt:
        sys.stderr.write("\nthe viewer has ended\n")
    return 0
