# SPDX-License-Identifier: Apache-2.0
"""Baselines for joints: networks in the manner of published ones, trained on our random worlds."""
