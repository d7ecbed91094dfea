# SPDX-License-Identifier: Apache-2.0
"""Kirchhoff shadows of bodies on paths."""
