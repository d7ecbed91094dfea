# SPDX-License-Identifier: Apache-2.0
"""What the stages of `generate` usually take, for machines that have not measured their own.

Seconds of two workers, each with a core of an AMD EPYC for itself (2026-11-24): one person in
`living_room_walk`, every second frame from 10 to 22 (at depth 3 to 14). Processor time was counted,
as others were at work on the machine (of `sar`, of three frames, wall time less their share); a
start includes loading, not the one compilation of kernels after installation.
"""

from __future__ import annotations

from rfgs_core.past import Speed

#: Blender's start, and the mesh of a frame.
EXPORT = Speed(0.6, 0.0064)

#: Tracer, radio and depth → start, and time from one frame to the next.
TRACE: dict[tuple[str, str, int], Speed] = {
    ("sionna", "wifi", 1): Speed(5.0, 0.28),
    ("sionna", "wifi", 2): Speed(6.0, 1.55),
    ("sionna", "wifi", 3): Speed(6.0, 10.2),
    ("sionna", "wifi_commodity", 1): Speed(5.0, 0.125),
    ("sionna", "wifi_commodity", 2): Speed(6.0, 0.9),
    ("sionna", "wifi_commodity", 3): Speed(6.0, 6.6),
    ("sionna", "wifi24", 1): Speed(5.0, 0.14),
    ("sionna", "wifi24", 2): Speed(6.0, 0.37),
    ("sionna", "wifi24", 3): Speed(6.0, 1.4),
    ("sionna", "mmwave", 1): Speed(7.0, 0.11),
    ("sionna", "mmwave", 2): Speed(12.0, 1.28),
    ("sionna", "mmwave", 3): Speed(12.0, 10.0),
    ("sionna", "uwb", 1): Speed(40.0, 3.15),
    ("sionna", "sar", 1): Speed(100.0, 2.4),
    ("fast", "wifi", 1): Speed(5.0, 0.2),
    ("fast", "wifi", 2): Speed(6.0, 0.33),
    ("fast", "wifi", 3): Speed(6.0, 0.45),
    ("fast", "wifi_commodity", 1): Speed(5.0, 0.115),
    ("fast", "wifi_commodity", 2): Speed(6.0, 0.21),
    ("fast", "wifi_commodity", 3): Speed(6.0, 0.26),
    ("fast", "wifi24", 1): Speed(5.0, 0.125),
    ("fast", "wifi24", 2): Speed(6.0, 0.145),
    ("fast", "wifi24", 3): Speed(6.0, 0.16),
    ("fast", "mmwave", 1): Speed(7.0, 0.016),
    ("fast", "mmwave", 2): Speed(9.0, 0.09),
    ("fast", "mmwave", 3): Speed(9.0, 0.11),
    ("fast", "uwb", 1): Speed(40.0, 2.85),
}

#: What each further packet of a frame takes beside traces, as a share of a trace.
PACKET = {"sionna": 0.6, "fast": 0.31}
#: How much longer a frame takes whose paths are stored too.
PATHS = 1.25

#: Blender's start, with the scene made ready to render [s].
RENDER_START_S = 0.7
#: A picture without its pixels [s], and each sample of a pixel [s].
_PICTURE_S, _SAMPLE_S = 0.07, 2.75e-6

#: What is written once for a scene [B], and for what moves, for each person and frame [B].
GEOMETRY_BYTES, PERSON_BYTES = 1.1e6, 5.2e4


def render_step_s(pixels: float, samples: int) -> float:
    """Time of one picture [s].

    Args:
        pixels: Pixels of a picture.
        samples: Light samples of each.
    """
    return _PICTURE_S + _SAMPLE_S * pixels * samples
