# SPDX-License-Identifier: Apache-2.0
"""One transmitter and two receivers: where they stood, and what the receivers wrote."""

from __future__ import annotations

from pathlib import Path

from capture_files import feitcsi_file

LAYOUT = """
centre_hz: 5.5e9
devices:
  - {name: tx, role: TRANSMITTER, position_m: [0, 0, 1.2]}
  - {name: r1, role: RECEIVER, position_m: [3, 0, 1.2]}
  - {name: r2, role: RECEIVER, position_m: [0, 3, 1.2]}
"""


def write_captures(folder: Path) -> None:
    """Writes `a.csi` and `b.csi` of the receivers, and `radios.yaml`."""
    for name in ("a.csi", "b.csi"):
        feitcsi_file(folder / name, packets=20)
    (folder / "radios.yaml").write_text(f"name: lab\nradio: wifi\nfps: 10{LAYOUT}")
