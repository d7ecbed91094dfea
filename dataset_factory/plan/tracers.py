# SPDX-License-Identifier: Apache-2.0
"""The tracers there are, and where they run."""

from __future__ import annotations

from typing import Literal

#: Sionna RT, the reference; or `rfgs_core.simulate`, the fast one that is held against it.
TracerName = Literal["sionna", "fast"]

#: Where Sionna RT traces; auto: on a GPU where there is one.
TracingDevice = Literal["auto", "cpu", "cuda"]
