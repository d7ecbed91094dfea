# SPDX-License-Identifier: Apache-2.0
"""What `.ci/test_wheel.sh` runs beside the wheel: reading, training and viewing without extras.

It lies outside the clone then, beside a copy of tests/tiny_dataset.py.
"""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path

import numpy as np
from tiny_dataset import write_tiny_dataset

import rfgs_core
from rfgs_core import open_dataset
from rfgs_core.articulated import people
from rfgs_core.extras import EXTRA_OF


def rfgs(program: str, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
    """Runs a command of the wheel."""
    command = [str(Path(sys.executable).with_name(program)), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def works(program: str, *arguments: str | Path) -> None:
    """Runs a command that must succeed."""
    done = rfgs(program, *arguments)
    assert done.returncode == 0, f"{arguments}: {done.stdout[-2000:]}{done.stderr[-2000:]}"


def one_line(program: str, *arguments: str | Path) -> str:
    """The one line that a command without its extra ends with."""
    done = rfgs(program, *arguments)
    assert done.returncode == 2 and "Traceback" not in done.stderr, done.stderr[-2000:]
    return done.stderr.strip().splitlines()[-1]


def main() -> None:
    """Tries the wheel; an assertion names what fails."""
    assert "site-packages" in rfgs_core.__file__, rfgs_core.__file__
    assert int(np.__version__.split(".")[0]) >= 2, np.__version__
    extras = {"sionna", "mitsuba", "bpy", "anny", "dask"}
    assert extras <= set(EXTRA_OF)
    assert not [name for name in extras if importlib.util.find_spec(name)]

    data = write_tiny_dataset(Path("tiny"))
    sequence = open_dataset(data).sequence()
    assert sequence.radio("wifi")["csi"].shape == (2, 4, 32, 16)
    assert np.isfinite(sequence.csi("wifi", 1)).all()
    assert sequence.depth(sequence.cameras[0]["name"], 1).shape == (24, 24)

    assert people().body(np.zeros(3)).height_m > 1.5

    works("rfgs-factory", "validate", data)
    works("rfgs-factory", "stats", data)
    works("rfgs-factory", "scenes")
    fit = ("--gaussians", "200", "--iterations", "3", "--posture", "standing")
    works("rfgs", "train", data, "--radio", "wifi", "--out", "run", *fit)
    works("rfgs", "eval", "run", "--no-oracle")
    works("rfgs", "report", "run")
    works("rfgs", "export", "run", "--out", "gaussians.ply")
    works("rfgs", "render", "run", "--out", "pictures")

    said = one_line("rfgs-factory", "generate", "living_room_walk", "--radio", "wifi", "--out", "x")
    assert said == "error: sionna is not installed; run: pip install 'rfgs[factory]'", said
    assert "rfgs[factory]" in one_line("rfgs-factory", "verify")
    assert "rfgs[blender]" in one_line("rfgs-factory", "check", "living_room_walk")
    sys.stdout.write(f"the wheel works on NumPy {np.__version__}\n")


if __name__ == "__main__":
    main()
