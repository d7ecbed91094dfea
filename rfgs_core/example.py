# SPDX-License-Identifier: Apache-2.0
"""A small dataset and a run on it that come with the package: something to look at without waiting.

`make example` makes them anew; they hold one person who walks through the living room.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import sys
import tempfile
import zipfile
from pathlib import Path

from rfgs_core.cache import cache_folder
from rfgs_core.errors import RfgsError

#: What is shipped, and its digest: a file that was cut short on its way is told from a whole one.
ARCHIVE = Path(__file__).with_name("example.zip")
SHA256 = "3bec6bbcc31e06a31ab1e747f464e94418d987d60166e82dbff9ba5179670ac0"
#: Folders in the archive.
DATASET, RUN = "dataset", "run"
#: Entries of an archive have the same time on every machine.
_TIME = (2020, 1, 1, 0, 0, 0)
#: What only a training that goes on, or a page about data, would read.
_LEFT_OUT = ("checkpoints", "log", "report.html", "motion.png")


def example_folder() -> Path:
    """The example, unpacked into the user's cache unless it is there; it may be written to.

    Raises:
        RfgsError: It is not part of this installation, or damaged.
    """
    if not ARCHIVE.is_file():
        raise RfgsError(f"{ARCHIVE}: the example is not part of this installation; reinstall rfgs")
    if hashlib.sha256(ARCHIVE.read_bytes()).hexdigest() != SHA256:
        raise RfgsError(f"{ARCHIVE}: damaged, its digest is not {SHA256[:12]}…; reinstall rfgs")
    place = cache_folder("example") / SHA256[:16]
    if not place.is_dir():
        with tempfile.TemporaryDirectory(dir=place.parent) as folder:
            whole = Path(folder) / "example"
            with zipfile.ZipFile(ARCHIVE) as archive:
                archive.extractall(whole)
            try:
                whole.rename(place)
            except OSError:  # Somebody else was faster.
                if not place.is_dir():
                    raise
    return place


def chosen_run(run: Path | None, example: bool) -> Path:
    """The run that a command is about: the one that is named, or the example's.

    Raises:
        RfgsError: Neither is asked for, or both.
    """
    if (run is None) == (not example):
        raise RfgsError("expected the folder of a run, or --example for the one that comes along")
    if run is not None:
        return run
    place = example_folder()
    sys.stderr.write(f"the example, a person who walks through a room, lies in {place}\n")
    return place / RUN


def pack(dataset: Path, run: Path, file: Path) -> str:
    """Writes a dataset and a run as an archive; returns its digest.

    Args:
        dataset: Folder of the dataset.
        run: Folder of the run, beside the dataset and called `run`.
        file: The .zip to write.
    """
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, folder in ((DATASET, dataset), (RUN, run)):
            for path in sorted(folder.rglob("*")):
                within = path.relative_to(folder)
                if path.is_file() and within.parts[0] not in _LEFT_OUT:
                    entry = zipfile.ZipInfo(f"{name}/{within.as_posix()}", _TIME)
                    entry.compress_type = zipfile.ZIP_DEFLATED
                    archive.writestr(entry, path.read_bytes())
    return hashlib.sha256(file.read_bytes()).hexdigest()


def main() -> None:
    """`python -m rfgs_core.example FOLDER` packs FOLDER/dataset and FOLDER/run."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder
    digest = pack(folder / DATASET, folder / RUN, ARCHIVE)
    size_mb = os.path.getsize(ARCHIVE) / 1e6
    sys.stdout.write(f'{ARCHIVE}: {size_mb:.1f} MB; set SHA256 = "{digest}"\n')


if __name__ == "__main__":
    main()
