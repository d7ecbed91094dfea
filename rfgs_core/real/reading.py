# SPDX-License-Identifier: Apache-2.0
"""How fast captures are read: Intel 5300 beside csiread, FeitCSI by itself."""

from __future__ import annotations

import importlib.util
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from rfgs_core.capture import feitcsi, intel5300

#: Packets of the files that are written to be read.
INTEL_PACKETS, FEITCSI_PACKETS = 20_000, 4_000
_REPEATS = 5


def bench_readers() -> dict[str, float | str]:
    """Reads synthetic files of both formats; the best of five runs counts.

    Returns:
        MB/s of each reader, and the ratio to csiread where that is installed.
    """
    with tempfile.TemporaryDirectory() as folder:
        intel, feit = Path(folder) / "a.dat", Path(folder) / "a.csi"
        intel.write_bytes(_intel_bytes())
        feit.write_bytes(_feitcsi_bytes())
        result: dict[str, float | str] = {
            "intel5300_mb_s": _speed(intel, lambda: intel5300.read(intel)),
            "feitcsi_mb_s": _speed(feit, lambda: feitcsi.read(feit)),
        }
        if importlib.util.find_spec("csiread") is None:
            result["csiread"] = "not installed: pip install csiread"
            return result
        import csiread

        def peer() -> None:
            csiread.Intel(str(intel), nrxnum=3, ntxnum=1, if_report=False).read()

        result["csiread_mb_s"] = _speed(intel, peer)
    result["intel5300_over_csiread"] = float(result["intel5300_mb_s"]) / float(
        result["csiread_mb_s"]
    )
    return result


def _speed(path: Path, read: Callable[[], object]) -> float:
    """MB/s of the fastest of several runs; one more comes before, as it compiles."""
    read()
    best = np.inf
    for _ in range(_REPEATS):
        start = time.perf_counter()
        read()
        best = min(best, time.perf_counter() - start)
    return path.stat().st_size / best / 1e6


def _intel_bytes() -> bytes:
    """Packets of three RX and one TX antenna, random bits."""
    length = (30 * (3 + 16 * 3) + 7) // 8
    head = bytearray(23)
    head[:2], head[2] = (length + 21).to_bytes(2, "big"), 0xBB
    head[11], head[12], head[18] = 3, 1, 0b100100
    head[19:21] = length.to_bytes(2, "little")
    generator = np.random.default_rng(0)
    packets = np.zeros((INTEL_PACKETS, 23 + length), np.uint8)
    packets[:, :23] = np.frombuffer(bytes(head), np.uint8)
    packets[:, 23:] = generator.integers(0, 256, (INTEL_PACKETS, length), np.uint8)
    clock = 1000 * np.arange(INTEL_PACKETS)
    packets[:, 3:7] = clock.astype("<u4")[:, None].view(np.uint8)
    return packets.tobytes()


def _feitcsi_bytes() -> bytes:
    """80 MHz VHT packets of two RX antennas, random numbers."""
    count = 242
    head = np.zeros(272, np.uint8)
    head[:4] = np.array([8 * count], "<u4").view(np.uint8)
    head[46], head[47] = 2, 1
    head[52:56] = np.array([count], "<u4").view(np.uint8)
    head[92:96] = np.array([3 << 8 | 2 << 11], "<u4").view(np.uint8)
    generator = np.random.default_rng(0)
    packets = np.zeros((FEITCSI_PACKETS, 272 + 8 * count), np.uint8)
    packets[:, :272] = head
    packets[:, 272:] = generator.integers(0, 256, (FEITCSI_PACKETS, 8 * count), np.uint8)
    clock = 1000 * np.arange(FEITCSI_PACKETS)
    packets[:, 88:92] = clock.astype("<u4")[:, None].view(np.uint8)
    return packets.tobytes()
