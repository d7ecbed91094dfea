# SPDX-License-Identifier: Apache-2.0
"""Captures of real radios."""
