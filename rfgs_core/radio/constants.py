# SPDX-License-Identifier: Apache-2.0
"""Physical constants."""

from __future__ import annotations

#: Speed of light in vacuum [m/s].
SPEED_OF_LIGHT = 299_792_458.0
#: Vacuum permittivity [F/m].
VACUUM_PERMITTIVITY = 8.854_187_8128e-12
#: Boltzmann constant [J/K].
BOLTZMANN = 1.380_649e-23
