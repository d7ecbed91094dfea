# SPDX-License-Identifier: Apache-2.0
"""Radios of one's own: what is written is read, and what cannot be is refused in one line."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path

import pytest

from rfgs_core.errors import RfgsError
from rfgs_core.radio import PRESETS, preset
from rfgs_core.radio.files import radio_problems, radio_text, read_radio


@pytest.mark.parametrize("name", PRESETS)
def test_presets_are_possible_and_survive_a_file(name: str, tmp_path: Path) -> None:
    assert radio_problems(preset(name)) == []
    radio = replace(preset(name), name="mine", pattern="tr38901", polarization="cross")
    (tmp_path / "a.yaml").write_text(radio_text(radio), "utf-8")
    assert read_radio(tmp_path / "a.yaml") == radio
    (tmp_path / "a.json").write_text(json.dumps(asdict(radio)), "utf-8")
    assert read_radio(tmp_path / "a.json") == radio


def test_a_file_may_start_from_a_preset(tmp_path: Path) -> None:
    file = tmp_path / "lab.yml"
    file.write_text("like: wifi\nfreq_max_hz: 5.9e9\nrx_cols: 2\ntx_offset_m: [0, 0, -0.2]\n")
    expected = replace(
        preset("wifi"), name="lab", freq_max_hz=5.9e9, rx_cols=2, tx_offset_m=(0.0, 0.0, -0.2)
    )
    assert read_radio(file) == expected


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("like: lidar\n", "like: expected one of wifi"),
        ("like: [wifi]\n", "like: expected one of wifi"),
        ("like: wifi\nspeed: 3\n", "unknown field 'speed'"),
        ("like: wifi\n3: 3\n", "expected a name before the colon, got 3"),
        ("like: wifi\nlike: uwb\n", "line 1: the key 'like' stands twice"),
        ("like: wifi\nnum_subcarriers: 1:30\n", "expected a whole number, found '1:30'"),
        ("like: wifi\nheights_m: &a [1]\ntx_offset_m: *a\n", "line 3: found the alias 'a'"),
        ("name: x\n", "field 'freq_min_hz' is missing"),
        ("like: wifi\nname: wifi\nrx_rows: 2\n", "'wifi' is a preset's name"),
        ("like: wifi\nname: a/b\n", "name: 'a/b': expected letters"),
        ("like: wifi\nrx_rows: 2.5\n", "rx_rows: expected a whole number, found 2.5"),
        ("like: wifi\nrx_rows: true\n", "rx_rows: expected a whole number, found true"),
        ("like: wifi\nrx_rows: 0\n", "rx_rows: 0: expected at least 1"),
        ("like: wifi\nrx_rows: 1000\n", "more than 4096 elements"),
        ("like: wifi\npattern: yagi\n", "pattern: 'yagi': expected iso or dipole"),
        ("like: wifi\npolarization: RHCP\n", "polarization: 'RHCP': expected V or H"),
        (
            "like: wifi\nown_device_links: maybe\n",
            "expected excluded or included or only, found 'maybe'",
        ),
        ("like: wifi\nown_device_links: excluded\nnum_devices: 1\n", "no link"),
        (
            "like: wifi\nplacement: ceiling\n",
            "placement: expected circle or corners or walls, found 'ceiling'",
        ),
        ("like: wifi\nfreq_max_hz: 5e9\n", "expected an ascending band"),
        ("like: wifi\nfreq_max_hz: .inf\n", "freq_max_hz: expected a number, found '.inf'"),
        ("like: wifi\npower_dbm: loud\n", "power_dbm: expected a number, found 'loud'"),
        ("like: wifi\npower_dbm: nan\n", "power_dbm: expected a finite number, found nan"),
        ("like: wifi\nheights_m: [1e999]\n", "heights_m: expected a finite number, found inf"),
        ("like: wifi\nheights_m: []\n", "heights_m: expected at least one height"),
        (
            "like: wifi\ntx_offset_m: [0, 1]\n",
            "tx_offset_m: expected a list of length 3, found [0, 1]",
        ),
        ("like: wifi\nrx_cols: 1\nrx_rows: 1\ntx_offset_m: [0, 0, 0]\n", "tx_offset_m: a tran"),
        ("- 1\n", "expected an object, found [1]"),
        ("like: [\n", "no valid YAML"),
    ],
)
def test_bad_files_are_named_in_one_line(tmp_path: Path, text: str, said: str) -> None:
    file = tmp_path / "lab.yaml"
    file.write_text(text)
    with pytest.raises(RfgsError) as caught:
        read_radio(file)
    assert str(caught.value).startswith(f"{file}: ") and "\n" not in str(caught.value)
    assert said in str(caught.value)


def test_files_that_are_not_there_or_not_text(tmp_path: Path) -> None:
    with pytest.raises(RfgsError, match="no such file"):
        read_radio(tmp_path / "none.json")
    with pytest.raises(RfgsError, match=r"ending in \.json"):
        read_radio(tmp_path / "radio.txt")
    (tmp_path / "bin.json").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(RfgsError, match=r"bin\.json: expected JSON"):
        read_radio(tmp_path / "bin.json")
    (tmp_path / "bin.yaml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(RfgsError, match="expected a YAML text file"):
        read_radio(tmp_path / "bin.yaml")
