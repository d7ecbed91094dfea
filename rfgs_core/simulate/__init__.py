# SPDX-License-Identifier: Apache-2.0
"""Propagation without Sionna RT: geometry, paths, shadows, scattering surfaces, a fast tracer."""
