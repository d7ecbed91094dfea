# SPDX-License-Identifier: Apache-2.0
"""Times the add-on inside Blender, which runs as a program of its own."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from rfgs_core.errors import MissingToolError, RfgsError
from rfgs_core.records import read_record

#: What Blender's Python runs. The add-on needs not be installed there.
_CODE = """
import sys
sys.path.insert(0, {root!r})
import bpy
import addon_rfgs
addon_rfgs.register()
from pathlib import Path
from addon_rfgs.gaussians.bench import bench_gaussians
bench_gaussians(Path({out!r}), **{sizes!r})
"""


def bench_blender(
    program: Path | None = None,
    num_gaussians: int = 1_000_000,
    gaussians_per_frame: int = 100_000,
    frames: int = 20,
    loop_points: int = 20_000,
) -> dict[str, Any]:
    """Times importing Gaussians and playing a sequence of them, without drawing.

    Args:
        program: A real Blender; None takes $BLENDER, else pip's `bpy`.
        num_gaussians: Gaussians of the file that is imported.
        gaussians_per_frame: Gaussians per frame of the sequence.
        frames: Its frames.
        loop_points: Points of the loop it is compared with, whose time is scaled up.

    Returns:
        `import_s` with the first evaluation, `import_loop_s` of a loop over points, each the
        quickest of several, and their ratio; `points_fps`, `ellipsoids_fps` and `solid_fps` (real
        meshes for the Solid view), frame changes with evaluation of every cloud for the first
        time, `loop_fps` of writing positions point by point and `points_ratio`.

    Raises:
        MissingToolError: There is no such Blender, or no add-on beside this package.
        RfgsError: Blender failed.
    """
    found = importlib.util.find_spec("addon_rfgs")
    if found is None or not found.submodule_search_locations:
        raise MissingToolError("addon_rfgs is missing; install the whole of rfgs, add-on included")
    sizes = {
        "count": num_gaussians,
        "frame_count": gaussians_per_frame,
        "frames": frames,
        "loop_count": loop_points,
    }
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "bench.json"
        root = str(Path(found.submodule_search_locations[0]).resolve().parent)
        code = _CODE.format(root=root, out=str(out), sizes=sizes)
        named = program or os.environ.get("BLENDER")
        start = [str(named), "-b", "--factory-startup", "--python-exit-code", "1", "--python-expr"]
        command = [*(start if named else [sys.executable, "-c"]), code]
        try:
            done = subprocess.run(command, capture_output=True, text=True, check=False)
        except (FileNotFoundError, PermissionError) as error:
            raise MissingToolError(
                f"{command[0]}: no such program; --blender and $BLENDER expect the Blender program"
            ) from error
        if "No module named 'bpy'" in done.stderr:
            raise MissingToolError("bpy is missing; pip install it, or give --blender PROGRAM")
        if not out.exists():
            lines = [line for line in (done.stdout + done.stderr).splitlines() if line.strip()]
            raise RfgsError(f"Blender stopped with code {done.returncode}: {lines[-1:]}")
        return read_record(out, dict[str, float | int | str])
