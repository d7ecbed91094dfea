# SPDX-License-Identifier: Apache-2.0
"""The classes of arguments of a command."""

from __future__ import annotations

import typing
from typing import Any


def argument_classes(kind: Any) -> tuple[type, ...]:
    """One dataclass, or of a command of several parts that of each."""
    if isinstance(kind, type):
        return (kind,)
    return tuple(typing.get_args(annotated)[0] for annotated in typing.get_args(kind))
