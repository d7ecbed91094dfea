# SPDX-License-Identifier: Apache-2.0
"""Traces scene bundles, with Sionna RT or with the fast tracer.

Call `dataset_factory.trace.setup.prepare` first, then import `Tracer`, `ApertureTracer` for a
radio whose antennas move, or `FastBundleTracer` from here, which imports them on demand, since
Sionna RT reads its settings from the environment at import. `sionna_scene` prepares by itself.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

from dataset_factory.plan.tracers import TracerName
from dataset_factory.trace.sionna_scene import sionna_scene
from rfgs_core.radio import Radio

if TYPE_CHECKING:
    from dataset_factory.trace.aperture import ApertureTracer
    from dataset_factory.trace.fast import FastBundleTracer
    from dataset_factory.trace.tracer import Tracer

    AnyTracer: TypeAlias = Tracer | ApertureTracer | FastBundleTracer

__all__ = ["ApertureTracer", "FastBundleTracer", "Tracer", "sionna_scene", "tracer_class"]


def tracer_class(name: TracerName, radio: Radio) -> Any:
    """The class that traces a radio.

    Args:
        name: Which tracer.
        radio: The radio.
    """
    if name == "fast":
        from dataset_factory.trace.fast import FastBundleTracer

        return FastBundleTracer
    if radio.antennas_move:
        from dataset_factory.trace.aperture import ApertureTracer

        return ApertureTracer
    from dataset_factory.trace.tracer import Tracer

    return Tracer


def __getattr__(name: str) -> Any:
    """Imports a tracer when it is first asked for."""
    if name == "ApertureTracer":
        from dataset_factory.trace.aperture import ApertureTracer

        return ApertureTracer
    if name == "FastBundleTracer":
        from dataset_factory.trace.fast import FastBundleTracer

        return FastBundleTracer
    if name == "Tracer":
        from dataset_factory.trace.tracer import Tracer

        return Tracer
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
