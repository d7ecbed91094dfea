# SPDX-License-Identifier: GPL-3.0-or-later
"""Takes out of a file whatever this add-on put there."""
