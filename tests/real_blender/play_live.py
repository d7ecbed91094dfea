# SPDX-License-Identifier: GPL-3.0-or-later
"""Played inside Blender: a feed of `rfgs live` is followed by the button, and then stopped.

Argument: port of the feed.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import bpy
import numpy as np


def play(stage: Any) -> Iterator[float]:
    """Follows for twelve updates, stops, and notes what moved and how Blender kept up."""
    bpy.context.scene.rfgs.live.port = int(stage.arguments[0])
    yield from stage.open_tab("RFGS_PT_gaussians", "RFGS_PT_live")
    following = stage.part("live.following")

    yield from stage.click("rfgs.follow_live")
    yield from stage.wait(lambda: following._now and following._now.updates > 0, "first update", 60)
    first = places()
    stage.gaps_s.clear()
    yield from stage.wait(lambda: following._now.updates >= 12, "updates", 120)
    gaps_s, line = list(stage.gaps_s), following.told()
    moved_m = float(np.abs(places() - first).max())
    yield from stage.shoot("following")

    stage.takes_place_of("rfgs.stop_live", "rfgs.follow_live")
    yield from stage.click("rfgs.stop_live")
    yield from stage.wait(lambda: not following.following(), "the end", 20)
    stopped = places()
    yield 1.0
    row = {"line": line, "moved_m": moved_m, "gaps_s": gaps_s, "stopped": following.told()}
    row |= {"stays": bool((places() == stopped).all()), "count": len(stopped)}
    row |= {"still_sent": following._now is not None}
    (stage.out / "told.json").write_text(json.dumps(row))


def places() -> np.ndarray:
    """Places of the live cloud's Gaussians, (N, 3) [m]."""
    vertices = bpy.data.objects["Gaussians live"].data.vertices
    flat = np.zeros(3 * len(vertices), np.float32)
    vertices.foreach_get("co", flat)
    return flat.reshape(-1, 3)
