# SPDX-License-Identifier: Apache-2.0
"""Hidden entries by the spectra of visible ones, see `rfgs_core.measure.spectrum`."""

from __future__ import annotations

from rfgs_core.evaluate.baselines.gaussian_process import krige_level
from rfgs_core.evaluate.baselines.interpolation import interpolating_baseline
from rfgs_core.evaluate.evidence import BaselineResult, Evidence
from rfgs_core.measure.spectrum import spectral


def baseline(evidence: Evidence) -> BaselineResult:
    """Carries array columns and subcarriers on by spectra; levels between pairs are kriged."""
    return interpolating_baseline(evidence, spectral, krige_level)
