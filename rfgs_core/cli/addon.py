# SPDX-License-Identifier: Apache-2.0
"""`rfgs addon`: the extension of Blender, installed in one command or built as a file."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import tyro

from rfgs_core.cli.info import find_blender
from rfgs_core.errors import MissingToolError, RfgsError

#: The add-on as Blender knows an extension that was installed from a file.
EXTENSION = "bl_ext.user_default.addon_rfgs"
#: Blender may take a while to start on a busy machine [s].
_PATIENCE_S = 300
#: Entries of an archive have the same time on every machine, so that equal files give equal bytes.
_TIME = (2020, 1, 1, 0, 0, 0)

#: Writes where jobs run into the preferences of the add-on and saves them, if that is the add-on
#: of the archive. Blender ends with 0 whether it installed or not, and on a busy machine loses the
#: line that says which: only what lies there tells.
_TELL = """
import bpy, pathlib, sys, zipfile
if {extension!r} not in sys.modules:
    sys.exit("the add-on was not installed")
folder = pathlib.Path(sys.modules[{extension!r}].__file__).parent
with zipfile.ZipFile({archive!r}) as archive:
    for name in archive.namelist():
        file = folder / name
        if not file.is_file() or file.read_bytes() != archive.read(name):
            sys.exit("an older add-on is still there")
stored = bpy.context.preferences.addons[{extension!r}].preferences
stored.python = {python!r}
bpy.ops.wm.save_userpref()
print("rfgs-told", stored.python)
"""


@dataclass(frozen=True)
class AddonArgs:
    """Installs the add-on into your Blender and tells it which Python environment this is.

    `rfgs addon install` builds the extension, installs and enables it, and writes this environment
    into its preferences, so that Generate and Train work at once; an older one is replaced.
    `rfgs addon build` only writes the extension as a .zip for *Install from Disk*.
    """

    task: tyro.conf.Positional[Literal["install", "build"]]
    """What to do."""
    blender: Path | None = None
    """Blender 4.2 or newer; left out: $BLENDER, or the program `blender`."""
    out: Path | None = None
    """Folder for the .zip of `build`; the current one if left out."""


def run(args: AddonArgs) -> int:
    """Installs or builds; exit code 0."""
    if args.task == "build":
        if args.blender is not None:
            raise RfgsError("--blender: `rfgs addon build` needs none; leave it out")
        folder = args.out or Path()
        folder.mkdir(parents=True, exist_ok=True)
        sys.stdout.write(f"{build_extension(folder)} written\n")
        return 0
    if args.out is not None:
        raise RfgsError("--out: `rfgs addon install` writes into Blender; use `rfgs addon build`")
    program = _find_blender(args.blender)
    with tempfile.TemporaryDirectory(prefix="rfgs-") as folder:
        file = build_extension(Path(folder))
        install = ("extension", "install-file", "-r", "user_default", "-e", file)
        refused = _run(program, "", "-b", "--command", *install)
        python = str(Path(sys.prefix)) if sys.prefix != sys.base_prefix else sys.executable
        script = Path(folder, "tell.py")
        words = _TELL.format(extension=EXTENSION, python=python, archive=str(file))
        script.write_text(words, "utf-8")
        tell = ("-b", "--python-exit-code", "1", "--python", script)
        _run(program, "rfgs-told", *tell, instead=refused)
    sys.stdout.write(
        f"installed into {program}; jobs run in {python}. Open Blender, press N in the 3D view and "
        "choose the tab RF-GS\n"
    )
    return 0


def source_folder() -> Path:
    """Where the add-on lies beside this package.

    Raises:
        RfgsError: It was left out of this installation.
    """
    folder = Path(__file__).resolve().parents[2] / "addon_rfgs"
    if not (folder / "blender_manifest.toml").is_file():
        raise RfgsError(f"{folder}: the add-on is not part of this installation; reinstall rfgs")
    return folder


def build_extension(folder: Path) -> Path:
    """Writes the extension as Blender installs it; equal sources give equal bytes.

    Args:
        folder: Where to.

    Returns:
        The .zip, named after the add-on and its version.
    """
    import tomllib

    from rfgs_core.files import replacing

    source = source_folder()
    manifest = tomllib.loads((source / "blender_manifest.toml").read_text("utf-8"))
    target = folder / f"{manifest['id']}-{manifest['version']}.zip"
    with replacing(target) as temporary, zipfile.ZipFile(temporary, "w") as archive:
        for file in sorted(source.rglob("*")):
            name = file.relative_to(source)
            if not file.is_file() or any(_is_for_tools(part) for part in name.parts):
                continue
            entry = zipfile.ZipInfo(name.as_posix(), _TIME)
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            archive.writestr(entry, file.read_bytes())
    return target


def _is_for_tools(part: str) -> bool:
    """Whether a part of a path is none of the add-on's, as its manifest says too."""
    return part == "__pycache__" or part.startswith(".") or part.endswith(".pyc")


def _find_blender(wanted: Path | None) -> Path:
    """The Blender to install into.

    Raises:
        RfgsError: There is no such program.
        MissingToolError: None is named and none was found.
    """
    found = wanted or find_blender()
    if found is None:
        raise MissingToolError(
            "no Blender was found; name it with --blender /path/to/blender, or set BLENDER= "
            "(Blender 4.2 or newer, https://www.blender.org/download)"
        )
    if not found.is_file():
        raise RfgsError(f"{found}: no such program; name a Blender with --blender")
    return found.absolute()


def _run(program: Path, said: str, *arguments: str | Path, instead: str = "") -> str:
    """Runs Blender.

    Args:
        program: Blender.
        said: What it says when it did what it was asked to; "" if it says nothing of the kind.
        *arguments: What it is asked to do.
        instead: What is told in place of its last words if it did not.

    Returns:
        Its first line about an error, "" if there is none.

    Raises:
        RfgsError: It did not do it; its last words follow.
    """
    try:
        done = subprocess.run(
            [str(program), *map(str, arguments)],
            capture_output=True,
            text=True,
            errors="replace",
            timeout=_PATIENCE_S,
            check=False,
        )
    except OSError as error:
        raise RfgsError(f"{program}: cannot be started ({error.strerror})") from error
    except subprocess.TimeoutExpired as error:
        raise RfgsError(f"{program}: no answer within {_PATIENCE_S} s") from error
    lines = [line.strip() for line in (done.stdout + done.stderr).splitlines() if line.strip()]
    if done.returncode or said not in done.stdout:
        raise RfgsError(f"{program}: {instead or (lines[-1] if lines else 'it said nothing')}")
    return next((line for line in lines if line.upper().startswith("ERROR")), "")
