# SPDX-License-Identifier: Apache-2.0
"""Training sees everything that is not held out, and nothing else."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import zarr

from rfgs_core.dataset import open_dataset
from rfgs_core.dataset.csi_store import digest
from rfgs_core.dataset.names import SequenceFiles
from rfgs_core.errors import RfgsError
from rfgs_core.files import write_json
from rfgs_core.measure.observations import observe


def test_held_out_entries_are_zero_and_the_rest_is_the_data(tiny_dataset: Path) -> None:
    sequence = open_dataset(tiny_dataset).sequence()
    split = sequence.splits["rf"]["wifi"]
    seen = observe(sequence, "wifi", 2)
    csi, static = sequence.csi("wifi", 2), sequence.csi_static("wifi")
    # Held out: the last of four columns of 2 elements, 2 of 16 subcarriers, one pair both ways.
    assert len(split["rx_elements"]) == 8
    assert (~seen.subcarriers).nonzero()[0].tolist() == [10, 11]
    assert seen.links.sum() == 4 * 24 - 2 * 6
    ((a, b),) = split["device_pairs"]
    for tx in range(4):
        for rx in range(32):
            pair = {int(seen.layout.tx_device[tx]), int(seen.layout.rx_device[rx])}
            expected = rx not in split["rx_elements"] and pair != {a, b}
            assert seen.links[tx, rx] == expected
    keep = seen.links[..., None] & seen.subcarriers
    np.testing.assert_array_equal(seen.delta[keep], (csi - static)[keep])
    np.testing.assert_array_equal(seen.static[keep], static[keep])
    assert (seen.delta[~keep] == 0).all()
    assert (seen.static[~keep] == 0).all()
    assert seen.layout.measured.all()


def test_visible_nan_is_refused_and_hidden_nan_is_not_read(own_dataset: Path) -> None:
    sequence = open_dataset(own_dataset).sequence()
    clean = observe(sequence, "wifi", 1)
    files = SequenceFiles(own_dataset / "tiny")
    array = zarr.open_array(str(files.csi("wifi") / "csi"), mode="r+")

    def poison(where: np.ndarray) -> None:
        values = sequence.csi("wifi", 1)
        values[where] = complex(np.nan, np.inf)
        array[0] = values
        write_json(files.csi_done("wifi", 1), {"sha256": digest(values)})

    hidden = ~(clean.links[..., None] & clean.subcarriers)
    poison(hidden)
    again = observe(sequence, "wifi", 1)
    np.testing.assert_array_equal(again.delta, clean.delta)
    one = np.zeros_like(hidden)
    one[0, np.flatnonzero(clean.links[0])[0], 3] = True
    poison(one)
    with pytest.raises(RfgsError, match=r"csi of frame 1 \(tiny, wifi\) holds NaN or infinity"):
        observe(sequence, "wifi", 1)
