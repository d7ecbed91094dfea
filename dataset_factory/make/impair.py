# SPDX-License-Identifier: Apache-2.0
"""Adds impaired channels to a dataset; the clean ones are never written."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from tqdm import tqdm

from rfgs_core.dataset import Dataset, Sequence, open_dataset
from rfgs_core.dataset.impaired_store import (
    Impaired,
    has_impaired,
    impaired_folders,
    remove_impaired,
    writing_impaired,
)
from rfgs_core.dataset.schema import CONTENTS
from rfgs_core.dataset.writer import finish_dataset
from rfgs_core.errors import RfgsError
from rfgs_core.radio.impairments import Impairments, draw_impairments, impair
from rfgs_core.seeds import sub_seed


def impair_dataset(
    path: Path,
    settings: Impairments,
    *,
    radios: tuple[str, ...] = (),
    seed: int | None = None,
    replacing: bool = False,
) -> None:
    """Adds impaired channels to a finished dataset and seals it anew.

    Args:
        path: Folder of the dataset.
        settings: How strong each impairment is.
        radios: Which radios; none names all.
        seed: Root seed; None takes the dataset's own.
        replacing: Whether impaired channels may be there already.

    Raises:
        RfgsError: The dataset is damaged, lacks a radio, or has impaired channels already.
    """
    dataset = open_dataset(path)
    sequences = [dataset.sequence(name) for name in dataset.sequences]
    chosen = [(s, radio) for s in sequences for radio in (radios or s.radios)]
    stores = [sequence.files.csi(radio) for sequence, radio in chosen]
    for (sequence, radio), store in zip(chosen, stores, strict=True):
        sequence.radio_spec(radio)
        if has_impaired(store) and not replacing:
            raise RfgsError(f"{store}: impaired channels exist already; use --replace")
    # The new manifest must not vouch for damage that the old one would have shown.
    _refuse_damaged(dataset, stores)
    root = dataset.info.root_seed if seed is None else seed
    for (sequence, radio), store in zip(chosen, stores, strict=True):
        remove_impaired(store)
        impair_radio(sequence, radio, settings, root)
    has = [name for name in CONTENTS if name in {*dataset.has, "csi_impaired"}]
    finish_dataset(path, replace(dataset.info, has=has))


def impair_radio(sequence: Sequence, radio: str, settings: Impairments, seed: int) -> None:
    """Writes one radio's impaired channels; equal settings and seed give equal bytes."""
    spec, layout = sequence.radio_spec(radio), sequence.layout(radio)
    store, static = sequence.files.csi(radio), sequence.csi_static_samples(radio)
    times_s = [sequence.sample_times_s(radio, frame) for frame in sequence.frames]
    purpose = (sequence.info.scene, radio)
    draw = draw_impairments(settings, layout, np.concatenate(times_s), seed, *purpose)
    gains, count = [], len(times_s[0])
    with writing_impaired(store) as writer:
        bar = tqdm(sequence.frames, desc=f"impair {radio}", unit="frame")
        for index, frame in enumerate(bar):
            random = np.random.default_rng(sub_seed(seed, *purpose, frame, "impairments", "noise"))
            clean = sequence.csi_samples(radio, frame)
            rows = []
            # Sample by sample: a frame of many packets times a few temporaries is gigabytes.
            for sample in range(count):
                one = slice(index * count + sample, index * count + sample + 1)
                here = clean[sample : sample + 1]
                value, gain_db = impair(here, settings, draw, spec, layout, one, random, static)
                rows.append(value)
                gains.append(gain_db)
            writer.append(np.concatenate(rows))
        writer.describe(Impaired(settings, seed, draw, np.concatenate(gains)))


def _refuse_damaged(dataset: Dataset, stores: list[Path]) -> None:
    from dataset_factory.check.validate import checksum_faults

    # These are about to be replaced, and a stopped earlier run may have left some of them.
    replaced = tuple(f"{folder}/" for store in stores for folder in impaired_folders(store))
    faults = [fault for fault in checksum_faults(dataset.path) if not fault.startswith(replaced)]
    if faults:
        raise RfgsError(f"{faults[0]}; mend the dataset first")
