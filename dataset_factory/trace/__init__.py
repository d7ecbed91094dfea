# SPDX-License-Identifier: Apache-2.0
"""Traces scene bundles with Sionna RT.

Call `dataset_factory.trace.setup.prepare` first, then import `Tracer`, or `ApertureTracer` for a
radio whose antennas move, from here, which imports them on demand, since Sionna RT reads its
settings from the environment at import.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dataset_factory.trace.aperture import ApertureTracer
    from dataset_factory.trace.tracer import Tracer

__all__ = ["ApertureTracer", "Tracer"]


def __getattr__(name: str) -> Any:
    """Imports a tracer when it is first asked for."""
    if name == "ApertureTracer":
        from dataset_factory.trace.aperture import ApertureTracer

        return ApertureTracer
    if name == "Tracer":
        from dataset_factory.trace.tracer import Tracer

        return Tracer
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
