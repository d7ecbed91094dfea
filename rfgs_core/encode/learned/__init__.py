# SPDX-License-Identifier: Apache-2.0
"""Learned encoders: networks decide what to believe of a channel, physics where it belongs.

A network looks at the channel of a device pair in the domain of its kind of radio and weighs it,
32 times over (`networks`). What is left is sent back to the points with exact path lengths, as a
matched filter does (`steering`), and an attention over device pairs joins the amplitudes
(`attention`). Untrained, all weights of the channel are one: a matched filter under 32 overlapping
windows, joined over device pairs in 32 random ways.
"""

from __future__ import annotations

from rfgs_core.encode.learned.encoder import LearnedEncoder
from rfgs_core.encode.learned.networks import NetworkKind, network_for
from rfgs_core.encode.learned.store import load_encoder, save_encoder

__all__ = ["LearnedEncoder", "NetworkKind", "load_encoder", "network_for", "save_encoder"]
