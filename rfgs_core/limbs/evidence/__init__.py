# SPDX-License-Identifier: Apache-2.0
"""Poses by the evidence of a posed surface: no network, no training."""
