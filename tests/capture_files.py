# SPDX-License-Identifier: Apache-2.0
"""Miniature captures of every format, written from the formats' descriptions alone."""

from __future__ import annotations

import json
import os
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

#: Captures of others, beside the repository or where the variable says.
SHARED = (
    Path(os.environ.get("RFGS_SHARED_DATA", ""))
    if os.environ.get("RFGS_SHARED_DATA")
    else (Path(__file__).resolve().parents[2] / "shared" / "data")
)


def shared(name: str) -> Path:
    """A capture of others; skips the test where it is not there."""
    path = SHARED / name
    if not path.exists():
        pytest.skip(f"no {name} in {SHARED}; set RFGS_SHARED_DATA to the folder that holds it")
    return path


def integers(shape: tuple[int, ...], most: int, seed: int = 0) -> np.ndarray:
    """Complex numbers with whole parts, none of them zero."""
    generator = np.random.default_rng(seed)
    parts = generator.integers(1, most, (*shape, 2)) * generator.choice([-1, 1], (*shape, 2))
    return (parts[..., 0] + 1j * parts[..., 1]).astype(np.complex64)


def intel_bits(chains: np.ndarray) -> bytes:
    """Bit stream of an Intel 5300: (chain, stream, 30) → bytes."""
    bits: list[int] = []
    for group in range(30):
        bits += [0, 0, 0]
        for value in chains[:, :, group].ravel():
            for part in (int(value.real), int(value.imag)):
                bits += [(part & 0xFF) >> bit & 1 for bit in range(8)]
    bits += [0] * (-len(bits) % 8)
    return np.packbits(np.array(bits, np.uint8), bitorder="little").tobytes()


def intel5300_record(chains: np.ndarray, selection: int, clock_us: int, rate: int = 0x101) -> bytes:
    """One record with its channel in the order of RX chains, (chain, stream, 30)."""
    stream = intel_bits(chains)
    head = struct.pack(
        "<IHHBBBBBbBBHH",
        *(clock_us, 7, 0, chains.shape[0], chains.shape[1]),
        *(40, 41, 42, -92, 30, selection, len(stream), rate),
    )
    return struct.pack(">HB", len(head) + len(stream) + 1, 0xBB) + head + stream


def intel5300_file(path: Path, packets: int = 6, streams: int = 1) -> np.ndarray:
    """Writes packets whose antenna selection changes; returns (time, antenna, stream, 30)."""
    antennas = integers((packets, 3, streams, 30), 100)
    orders = ([0, 1, 2], [2, 0, 1], [1, 0, 2])
    data = b""
    for time in range(packets):
        ports = orders[time % 3]
        selection = sum(port << (2 * chain) for chain, port in enumerate(ports))
        clock = (2**32 - 2500 + 1000 * time) % 2**32
        data += intel5300_record(antennas[time, ports], selection, clock)
        data += struct.pack(">HB", 5, 0xC1) + b"mac!"
    path.write_bytes(data)
    return antennas


def feitcsi_record(value: np.ndarray, clock_us: int, form: int = 2, width: int = 0) -> bytes:
    """One record, (rx, tx, subcarrier)."""
    head = bytearray(272)
    struct.pack_into("<I", head, 0, 4 * value.size)
    struct.pack_into("<II", head, 8, clock_us * 320, 0)
    head[46], head[47] = value.shape[:2]
    struct.pack_into("<I", head, 52, value.shape[2])
    struct.pack_into("<II", head, 60, 47, 52)
    struct.pack_into("<I", head, 88, clock_us)
    struct.pack_into("<I", head, 92, form << 8 | width << 11)
    return bytes(head) + parts(value, "<i2")


def parts(value: np.ndarray, kind: str) -> bytes:
    """Real and imaginary parts in turn."""
    return np.stack([value.real, value.imag], -1).astype(kind).tobytes()


def feitcsi_file(path: Path, packets: int = 5, count: int = 56) -> np.ndarray:
    """Writes 20 MHz HT packets; returns (time, rx, tx, subcarrier)."""
    value = integers((packets, 2, 1, count), 300)
    records = (feitcsi_record(value[k], 1000 + 20_000 * k) for k in range(packets))
    path.write_bytes(b"".join(records))
    return value


_BASIC = {
    1: "<HQhBHHBBBBbBBBB",
    2: "<HQhBHHBBBBBBbBBBB",
    3: "<HQhhhBHHBBBBBBbbbbb",
    4: "<HQQhhhBHHBBBBBBbbbbb",
    5: "<HQQhhhHBHHBBBBBBbb8b",
}


def picoscenes_segment(name: bytes, version: int, content: bytes) -> bytes:
    """A segment with its length and version."""
    body = struct.pack("<B", len(name) + 1) + name + b"\0" + struct.pack("<H", version) + content
    return struct.pack("<I", len(body)) + body


def picoscenes_frame(
    payload: bytes,
    shape: tuple[int, int, int],
    *,
    device: int = 0x2000,
    form: int = 1,
    basic: int = 5,
    csi: int = 4,
    clock_us: int = 0,
    selection: int = 0,
) -> bytes:
    """A frame of 20 MHz at 5.5 GHz with a payload in the device's coding, (rx, tx, subcarrier)."""
    num_rx, num_tx, count = shape
    early = [device, clock_us, *([0] if basic > 3 else []), 5500]
    middle = {1: [form, 20], 2: [form, 20], 3: [5500, 20, form, 20], 4: [5500, 20, form, 20]}
    rows = [*early, *middle.get(basic, [0, 5500, 20, form, 20]), 800, 0, num_tx, 0, num_rx]
    rows += [1, 0] if basic > 1 else []
    rows += [-90, 30 if basic < 3 else -60]
    left = {1: 3, 2: 3, 3: 3, 4: 3, 5: 8}[basic]
    head = struct.pack(_BASIC[basic], *rows, *([0] * left))
    row = [device, *([1] if csi > 3 else []), form, 20, 5_500_000_000, 20_000_000, 312_500, count]
    row += [num_tx, num_rx, 0, *([1] if csi > 2 else []), selection, *([0] if csi > 1 else [])]
    code = {1: "<HBHQQIHBBBBI", 2: "<HBHQQIHBBBBhI", 3: "<HBHQQIHBBBHBhI", 4: "<HBBHQQIHBBBHBhI"}
    channel = struct.pack(code[csi], *row, len(payload)) + payload
    segments = picoscenes_segment(b"RxSBasic", basic, head)
    segments += picoscenes_segment(b"CSI", csi, channel)
    body = struct.pack("<IHB", 0x20150315, 1, 2) + segments + b"frame of the MAC"
    return struct.pack("<I", len(body)) + body


def picoscenes_file(path: Path, basic: int = 5, csi: int = 4) -> np.ndarray:
    """Writes 4 HT and 2 non-HT packets of an AX200; returns the HT ones."""
    value = integers((4, 2, 1, 56), 300)
    other = integers((2, 2, 1, 52), 300)
    data = b""
    for time in range(4):
        payload = parts(value[time], "<i2")
        shape, clock = value.shape[1:], 1000 + 500 * time
        data += picoscenes_frame(payload, shape, basic=basic, csi=csi, clock_us=clock)
        if time < 2:
            payload = parts(other[time], "<i2")
            data += picoscenes_frame(payload, (2, 1, 52), form=0, basic=basic, csi=csi)
    path.write_bytes(data)
    return value


def nexmon_packet(words: np.ndarray, *, chip: int, where: int, sequence: int, time: int) -> bytes:
    """A pcap record of one core and stream."""
    payload = struct.pack("<HbB6sHHHH", 0x1111, -55, 8, b"sender", sequence, where, 0xE06A, chip)
    payload += words.astype("<u4").tobytes()
    udp = struct.pack(">HHHH", 5500, 5500, 8 + len(payload), 0)
    ip = struct.pack(">BBHHHBBHII", 0x45, 0, 28 + len(payload), 0, 0, 1, 17, 0, 1, 2)
    packet = bytes(6) + b"NEXMON" + b"\x08\x00" + ip + udp + payload
    return struct.pack("<IIII", 10, time, len(packet), len(packet)) + packet


def nexmon_words(value: np.ndarray) -> np.ndarray:
    """16-bit parts in one word."""
    return np.frombuffer(parts(value, "<i2"), "<u4")


def nexmon_file(path: Path, packets: int = 4) -> np.ndarray:
    """Writes 80 MHz packets of two cores; returns (time, core, bin) in FFT order."""
    value = integers((packets, 2, 256), 3000)
    data = struct.pack("<IHHIIII", 0xA1B2C3D4, 2, 4, 0, 0, 65535, 1)
    for time in range(packets):
        for core in range(2):
            words = nexmon_words(value[time, core])
            data += nexmon_packet(words, chip=0x65, where=core, sequence=time, time=1000 * time)
    path.write_bytes(data)
    return value


ESP_HEADER = (
    "type,id,mac,rssi,rate,sig_mode,mcs,bandwidth,smoothing,not_sounding,aggregation,stbc,"
    "fec_coding,sgi,noise_floor,ampdu_cnt,channel,secondary_channel,local_timestamp,ant,sig_len,"
    "rx_state,len,first_word,data\n"
)


def esp32_line(
    samples: np.ndarray, time: int = 0, *, second: int = 0, wide: int = 0, stbc: int = 0
) -> str:
    """A line of esp-csi of an HT packet, up to the ESP32-S3 and C3."""
    numbers = np.stack([samples.imag, samples.real], -1).astype(int).ravel()
    fields = f"CSI_DATA,{time},1a:00:00:00:00:00,-40,11,1,0,{wide},1,1,0,{stbc},0,0,-96,0,11,"
    fields += f"{second},{1000 * (time + 1)},0,101,0,{len(numbers)},0,"
    return f'{fields}"[{",".join(map(str, numbers))}]"\n'


def new_esp32_line(samples: np.ndarray, time: int = 0, agc: int = 20, fft: int = 8) -> str:
    """A line of esp-csi of a chip since the ESP32-C5."""
    numbers = np.stack([samples.imag, samples.real], -1).astype(int).ravel()
    fields = f"CSI_DATA,{time},1a:00:00:00:00:00,-40,11,-96,{fft},{agc},11,{1000 * (time + 1)},101"
    return f'{fields},0,{len(numbers)},0,"[{",".join(map(str, numbers))}]"\n'


def esp32_file(path: Path, packets: int = 3) -> np.ndarray:
    """Writes esp-csi lines of 20 MHz HT packets; returns (time, 128) in the chip's order."""
    value = integers((packets, 128), 100)
    lines = [esp32_line(value[time], time) for time in range(packets)]
    path.write_text(ESP_HEADER + "".join(lines))
    return value


def dw1000_file(path: Path, receptions: int = 4, taps: int = 1016) -> np.ndarray:
    """Writes a log; returns (time, tap)."""
    value = integers((receptions, taps), 900)
    lines = [
        "File:x.log, created by DecaRanging MP",
        "Mode: 2, Chan 2, Code 9, PRF 64, Plength 1024",
    ]
    for time in range(receptions):
        lines += [f"21 4E Rx time = {17.0 + 0.15 * time if time < 2 else 0.1 + time:.9e} 813F", ""]
        lines.append(
            f"RX OK WInd(0735), HLP(07{40 + time}.5000), PSC(0429), RSL(-081.5), FSL(-086.5)"
        )
        lines.append(f"Accum Len {taps}")
        lines += [f"{int(tap.real)}, {int(tap.imag)}" for tap in value[time]]
        if time % 2:
            lines.append("Anchor ToF: 8.783 ns Dist: 2.632173 m DistRaw: 2.542173 m")
    path.write_bytes("\r\n".join(lines).encode())
    return value


def acconeer_file(path: Path, frames: int = 5, sweeps: int = 2) -> np.ndarray:
    """Writes a recording of two subsweeps; returns (frame, sweep, point) as stored."""
    h5py = pytest.importorskip("h5py")
    value = integers((frames, sweeps, 7), 3000)
    kind = np.dtype([("real", "<i2"), ("imag", "<i2")])
    stored = np.zeros(value.shape, kind)
    stored["real"], stored["imag"] = value.real, value.imag
    rows = [
        {"start_point": 40, "num_points": 4, "step_length": 10, "profile": "PROFILE_3"},
        {"start_point": 10, "num_points": 3, "step_length": 10, "profile": "PROFILE_1"},
    ]
    sensor = {"frame_rate": 20.0, "sweep_rate": 1000.0, "subsweeps": rows}
    with h5py.File(path, "w") as file:
        file["server_info"] = json.dumps({"ticks_per_second": 1000})
        file["sessions/session_0/session_config"] = json.dumps({"groups": [{"1": sensor}]})
        entry = file.create_group("sessions/session_0/group_0/entry_0")
        entry["metadata"] = json.dumps({"base_step_length_m": 0.0025})
        entry["result/frame"] = stored
        entry["result/tick"] = 50 * np.arange(frames)
        entry["result/temperature"] = np.full(frames, 30)
    return value


def newrf_file(path: Path, receivers: int = 6) -> np.ndarray:
    """Writes a table of receivers, one of them empty; returns the places and channels of all."""
    from scipy.io import savemat

    value = integers((receivers,), 50) / 1000
    fields = ("TxPos", "RxPos", "Frequency", "CSI")
    table = np.zeros((receivers, 1), [(name, object) for name in fields])
    for row in range(receivers):
        cells = (np.array([[1.0], [2.0], [3.0]]), np.full((3, 1), float(row)), 2.412, value[row])
        for name, cell in zip(fields, cells, strict=True):
            table[name][row, 0] = np.zeros((1, 0)) if row == 1 else np.atleast_2d(cell)
    savemat(path, {"subdataset": table})
    return value


def afrl_file(path: Path, pulses: int = 5, bins: int = 8) -> np.ndarray:
    """Writes a phase history; returns (frequency, pulse)."""
    from scipy.io import savemat

    value = integers((bins, pulses), 50) / 100
    angle = np.linspace(0, 0.02, pulses)
    data = {
        "fp": value,
        "freq": np.linspace(9.2e9, 9.9e9, bins)[:, None],
        "x": 7000 * np.cos(angle)[None],
        "y": 7000 * np.sin(angle)[None],
        "z": np.full((1, pulses), 7000.0),
        "r0": np.full((1, pulses), 7000 * 2**0.5),
    }
    savemat(path, {"data": data})
    return value


TI_SETTINGS = {
    **{"samples": 8, "rx": 2, "tx": 2, "loops": 3, "order": "iiqq", "start_hz": 77.0e9},
    **{"slope_hz_per_s": 6e13, "sample_rate_hz": 5e6, "chirp_s": 6e-5, "frame_s": 0.05},
}


def ti_file(path: Path, frames: int = 2) -> np.ndarray:
    """Writes frames and their settings; returns (frame, loop, tx, rx, sample)."""
    value = integers((frames, 3, 2, 2, 8), 2000)
    pairs = value.reshape(-1, 2)
    path.write_bytes(np.stack([pairs.real, pairs.imag], 1).astype("<i2").tobytes())
    lines = "".join(f"{name}: {content}\n" for name, content in TI_SETTINGS.items())
    path.with_suffix(".yaml").write_text(lines)
    return value


#: Format → name of its file and what writes it; those that are one file of bytes.
WRITERS: dict[str, tuple[str, Callable[[Path], np.ndarray]]] = {
    "intel5300": ("a.dat", intel5300_file),
    "feitcsi": ("a.csi", feitcsi_file),
    "picoscenes": ("a.csi", picoscenes_file),
    "nexmon": ("a.pcap", nexmon_file),
    "esp32": ("a.csv", esp32_file),
    "dw1000": ("a.log", dw1000_file),
    "acconeer": ("a.h5", acconeer_file),
    "matlab": ("a.mat", newrf_file),
    "ti_adc": ("a.bin", ti_file),
}
