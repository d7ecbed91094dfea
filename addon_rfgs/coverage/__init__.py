# SPDX-License-Identifier: GPL-3.0-or-later
"""How loud transmitters are over a level plane, shown as a coloured surface."""
