# SPDX-License-Identifier: GPL-3.0-or-later
"""Cars, a van and a forklift: how they look and how they drive."""
