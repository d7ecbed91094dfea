# SPDX-License-Identifier: Apache-2.0
"""`rfgs inspect`: what a capture holds."""
from dataclasses import dataclass
from pathlib import Path
import tyro
@dataclass(frozen=True)
class InspectArgs:
    """Tells what a capture of a real radio holds, with pictures of it."""
    file: tyro.conf.Positional[Path]
def run(args): return 0
