# SPDX-License-Identifier: Apache-2.0
"""The data that a run was trained on."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from rfgs_core.dataset import Sequence, open_dataset
from rfgs_core.dataset.observed import Observed
from rfgs_core.errors import RfgsError


def need_a_band(sequence: Sequence, radio: str) -> None:
    """Refuses radios that tell no delays.

    Raises:
        RfgsError: The radio has a single subcarrier.
    """
    if sequence.radio_spec(radio).num_subcarriers < 2:
        raise RfgsError(
            f"{radio} has a single subcarrier: it tells no delays, by which places are found; "
            "expected a radio of two subcarriers or more"
        )


def need_one_port(sequence: Sequence, radio: str) -> None:
    """Refuses radios whose antennas have two polarisations.

    Raises:
        RfgsError: They have. One reflectivity, and sums over the links of a device pair, hold for
            one pair of ports: upright antennas hear a body by VV and HH with opposite signs.
    """
    spec = sequence.radio_spec(radio)
    if len(spec.slants_deg) > 1:
        raise RfgsError(
            f"{radio} has antennas of two polarisations ({spec.polarization}), whose ports hear a "
            "body with different signs, which no fit here models; expected a radio file with "
            "polarization: V or H, traced again"
        )


@lru_cache(maxsize=8)
def trained_sequence(
    run: Path, place: Path, name: str, fingerprint: str, channel: Observed
) -> Sequence:
    """The sequence of a run, out of the dataset at `place`.

    Raises:
        RfgsError: The dataset is gone, or is not the one of training.
    """
    if not place.exists():
        raise RfgsError(
            f"{run}: the dataset it was trained on is no longer at {place}; bring it back, or run "
            "the same `rfgs train` with its new place"
        )
    dataset = open_dataset(place)
    if fingerprint not in dataset.fingerprints(channel):
        raise RfgsError(
            f"{run} was trained on another dataset than {place} holds now (expected fingerprint "
            f"{fingerprint[:12]}, found {dataset.fingerprint[:12]}); train again or restore that "
            "dataset"
        )
    return dataset.sequence(name)
