# SPDX-License-Identifier: Apache-2.0
"""`rfgs info`: what is installed, and what to do about what is not."""

from __future__ import annotations

import importlib.util
import os
import platform
import shutil
import subprocess
import sys
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

PACKAGES = ("rfgs", "numpy", "torch", "numba", "xarray", "zarr", "viser")
OPTIONAL = {
    "sionna-rt": "traces channels: pip install 'rfgs[factory]'",
    "bpy": "Blender as a module, for Python 3.11: pip install 'rfgs[blender]'",
    "anny": "builds the people of the scenes: pip install 'rfgs[scenes]'",
    "triton": "compiles the kernels of --device cuda: pip install 'rfgs[gpu]'",
    "lpips": "the LPIPS picture metric: pip install lpips",
    "distributed": "workers that trace: pip install 'rfgs[factory]'",
    "playwright": "pictures of the viewer: pip install 'rfgs[picture]'",
}


@dataclass(frozen=True)
class InfoArgs:
    """Prints versions, LLVM, GPU and Blender, and the remedy for each problem."""


def _package_rows() -> list[tuple[str, str, str]]:
    rows = []
    for name in (*PACKAGES, *OPTIONAL):
        try:
            rows.append((name, metadata.version(name), ""))
        except metadata.PackageNotFoundError:
            remedy = OPTIONAL.get(name)
            if remedy:
                rows.append((name, "not installed (optional)", remedy))
            else:
                rows.append((name, "MISSING", "run `make test` once, or pip install -e ."))
    return rows


def _llvm_row() -> tuple[str, str, str]:
    from rfgs_core.errors import MissingToolError
    from rfgs_core.llvm import use_llvm

    try:
        path, version = use_llvm()
    except MissingToolError as error:
        # Only Sionna RT needs it.
        wanted = importlib.util.find_spec("sionna") is not None
        return ("LLVM", "PROBLEM" if wanted else "none (optional)", str(error))
    return ("LLVM", f"{version} ({path.name})", "")


def _gpu_row() -> tuple[str, str, str]:
    import torch

    if torch.cuda.is_available():
        return ("GPU", torch.cuda.get_device_name(0), "")
    built = torch.version.cuda or "the CPU only"
    return ("GPU", "none", f"not needed; --device cuda wants one, and torch is built for {built}")


def find_blender() -> Path | None:
    """Blender from $BLENDER, from the clone's .blender/ or from the search path."""
    local = Path(__file__).resolve().parents[2] / ".blender" / "blender"
    for found in (os.environ.get("BLENDER"), str(local), shutil.which("blender")):
        if found and Path(found).exists():
            return Path(found)
    return None


def _blender_row() -> tuple[str, str, str]:
    program = find_blender()
    if program is None:
        return (
            "Blender",
            "not found (optional)",
            "pip's bpy is used; for the panel install Blender 4.2 or newer, or set BLENDER=",
        )
    answer = subprocess.run(
        [str(program), "--version"], capture_output=True, text=True, timeout=120, check=False
    )
    first = (answer.stdout or answer.stderr).strip().splitlines()[:1]
    if answer.returncode:
        return ("Blender", f"PROBLEM: {' '.join(first)}", f"{program} does not start; reinstall it")
    return ("Blender", " ".join(first), "")


def run(_args: InfoArgs) -> int:
    """Prints the table; exit code 1 when something needed is missing."""
    rows = [
        ("Python", platform.python_version(), ""),
        ("System", f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores", ""),
        *_package_rows(),
        _llvm_row(),
        _gpu_row(),
        _blender_row(),
    ]
    for name, value, remedy in rows:
        sys.stdout.write(f"{name:<12} {value}{'  → ' + remedy if remedy else ''}\n")
    return int(any(value.startswith(("MISSING", "PROBLEM")) for _, value, _ in rows))
