# SPDX-License-Identifier: Apache-2.0
"""The dataset factory: from a Blender file with moving people to radio data with pictures."""

from __future__ import annotations
