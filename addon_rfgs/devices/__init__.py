# SPDX-License-Identifier: GPL-3.0-or-later
"""Radio devices in the scene."""
