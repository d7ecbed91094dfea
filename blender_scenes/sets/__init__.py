# SPDX-License-Identifier: GPL-3.0-or-later
"""Sets: the rooms that people move in, and what stands in them."""
