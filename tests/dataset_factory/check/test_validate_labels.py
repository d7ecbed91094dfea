# SPDX-License-Identifier: Apache-2.0
"""Flipped bytes anywhere, and labels that do not belong to the pictures beside them, are named."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from dataset_factory.check.validate import checksum_faults, validate
from dataset_factory.make.impair import impair_dataset
from rfgs_core.dataset import open_dataset
from rfgs_core.dataset.csi_store import write_csi
from rfgs_core.dataset.impaired_store import Impaired, remove_impaired, writing_impaired
from rfgs_core.dataset.pictures import write_png
from rfgs_core.dataset.writer import MANIFEST, write_arrays
from rfgs_core.radio.impairments import IMPAIRMENT_PRESETS

Faults = Callable[[Path], list[str]]


def test_a_sound_dataset_has_no_faults(tiny_copy: Path) -> None:
    impair_dataset(tiny_copy, IMPAIRMENT_PRESETS["commodity"])
    assert validate(tiny_copy) == []


def test_a_flipped_bit_anywhere_is_found_and_named(tiny_copy: Path) -> None:
    impair_dataset(tiny_copy, IMPAIRMENT_PRESETS["lab"])
    random = np.random.default_rng(17)
    files = sorted(file for file in tiny_copy.rglob("*") if file.is_file())
    names = {file.name for file in files}
    assert {MANIFEST, "dataset.json", "sequence.json", "zarr.json"} <= names
    for file in files:
        data = file.read_bytes()
        # The seals themselves are tried most thoroughly: nothing else watches them.
        for _ in range(60 if file.name in (MANIFEST, "dataset.json") else 2):
            damaged = bytearray(data)
            damaged[random.integers(len(data))] ^= 1 << random.integers(8)
            file.write_bytes(damaged)
            faults = checksum_faults(tiny_copy)
            assert faults and all(str(file) in fault for fault in faults), (file, faults)
        file.write_bytes(data)
    assert checksum_faults(tiny_copy) == []


def test_a_mask_where_nobody_is_is_named(resealed: Faults, tiny_copy: Path) -> None:
    file = tiny_copy / "tiny/mask/cam01/000002.png"
    mask = open_dataset(tiny_copy).sequence().mask("cam01", 2)
    write_png(file, np.roll(mask, 9, axis=1))
    assert f"{file}: instance 1 is seen where its mesh is not" in resealed(tiny_copy)


def test_joints_beside_their_mask_are_named(resealed: Faults, tiny_copy: Path) -> None:
    file = tiny_copy / "tiny/mask/cam02/000001.png"
    write_png(file, np.zeros((24, 24), np.uint16))
    assert f"{file}: 15 of 15 visible joints of person 1 lie off its mask" in resealed(tiny_copy)


def test_joints_of_another_place_are_named(resealed: Faults, tiny_copy: Path) -> None:
    sequence = open_dataset(tiny_copy).sequence()
    file = sequence.files.geometry(2)
    stored = dict(np.load(file))
    stored["joints"] = stored["joints"] + np.float32(0.6)
    write_arrays(file, **stored)
    assert f"{file}: joints of person 1 lie outside its mesh" in resealed(tiny_copy)
    stored["segment_velocity"] = stored["segment_velocity"] * np.float32(100)
    write_arrays(file, **stored)
    assert f"{file}: body segments faster than 50 m/s" in resealed(tiny_copy)
    stored["action"] = np.array(["walk", "sit"])
    write_arrays(file, **stored)
    faults = resealed(tiny_copy)
    assert any(str(file) in fault and "1 persons, 2 actions" in fault for fault in faults)


def test_a_channel_with_too_much_energy_is_named(resealed: Faults, tiny_copy: Path) -> None:
    sequence = open_dataset(tiny_copy).sequence()
    store, marker = sequence.files.csi("wifi"), sequence.files.csi_done("wifi", 2)
    write_csi(store, 1, 3 * sequence.csi("wifi", 2), marker)
    faults = resealed(tiny_copy)
    assert any("frame 2: " in fault and "energy of free space" in fault for fault in faults)


def test_impaired_values_that_contradict_the_lost_packets_are_named(
    resealed: Faults, tiny_copy: Path
) -> None:
    impair_dataset(tiny_copy, IMPAIRMENT_PRESETS["lab"])
    sequence = open_dataset(tiny_copy).sequence()
    known = sequence.impairments("wifi")
    values = [sequence.csi_samples("wifi", frame, impaired=True) for frame in sequence.frames]
    values[1][0, 0, 0, 3] = np.nan
    store = sequence.files.csi("wifi")
    remove_impaired(store)
    with writing_impaired(store) as writer:
        for value in values:
            writer.append(value)
        writer.describe(Impaired(known.settings, known.seed, known.draw, known.gain_db))
    faults = resealed(tiny_copy)
    assert len(faults) == 1 and "frame 2: missing values do not match" in faults[0]
