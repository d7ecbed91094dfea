# SPDX-License-Identifier: GPL-3.0-or-later
"""The people that scenes are cast with: bodies, clothes, rigged characters and their actions."""
