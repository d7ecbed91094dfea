# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene check as a list with buttons that select what is meant, and repair what is safe."""
