# SPDX-License-Identifier: GPL-3.0-or-later
"""What the open file holds, as data: surfaces, people, devices, cameras, and what was guessed."""
