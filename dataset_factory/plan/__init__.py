# SPDX-License-Identifier: Apache-2.0
"""What a run shall make, where, with how much disk and time."""
