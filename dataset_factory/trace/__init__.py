# SPDX-License-Identifier: Apache-2.0
"""Traces scene bundles with Sionna RT.

Call `dataset_factory.trace.setup.prepare` first, then import `Tracer` from
`dataset_factory.trace.tracer` (or from here, which imports it on demand, since Sionna RT reads
its settings from the environment at import).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dataset_factory.trace.tracer import Tracer

__all__ = ["Tracer"]


def __getattr__(name: str) -> Any:
    """Imports `Tracer` when it is first asked for."""
    if name == "Tracer":
        from dataset_factory.trace.tracer import Tracer

        return Tracer
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
