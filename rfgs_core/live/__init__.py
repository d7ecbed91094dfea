# SPDX-License-Identifier: Apache-2.0
"""Channels as they arrive: packets of several radios become moving Gaussians window by window.

Packets (`ears`, `records`, `clocks`) or a recording (`replay`) → windows on one clock (`windows`) →
what moved (`background`) → Gaussians (`cloud`, and whole fits beside it in `whole_fit`) → a page of
the viewer (`page`) and a socket that Blender reads (`feed`).
"""
