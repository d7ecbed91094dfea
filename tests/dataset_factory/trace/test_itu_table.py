# SPDX-License-Identifier: Apache-2.0
"""Permittivities of the radio materials are those that Sionna traces with."""

from __future__ import annotations

import numpy as np
import pytest

from rfgs_core.radio.constants import VACUUM_PERMITTIVITY
from rfgs_core.radio.materials import MATERIALS
from rfgs_core.radio.reflection import material_permittivity


@pytest.mark.parametrize("name", [name for name in MATERIALS if name != "skin"])
def test_permittivity_is_that_of_sionna(name: str) -> None:
    from rfgs_core.llvm import use_llvm

    use_llvm()
    import mitsuba as mi

    mi.set_variant("llvm_ad_mono_polarized")
    from sionna.rt.radio_materials.itu import itu_material

    freq_hz = float(np.sqrt(MATERIALS[name].freq_min_hz * MATERIALS[name].freq_max_hz))
    relative, conductivity = itu_material(name, mi.Float(freq_hz))
    ours = material_permittivity(name, np.array([freq_hz]))[0]
    assert ours.real == pytest.approx(float(np.array(relative).item()), rel=1e-5)
    loss = float(np.array(conductivity).item()) / (2 * np.pi * freq_hz * VACUUM_PERMITTIVITY)
    assert -ours.imag == pytest.approx(loss, rel=1e-4, abs=1e-9)
