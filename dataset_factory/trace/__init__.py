# SPDX-License-Identifier: Apache-2.0
"""Traces scene bundles with Sionna RT."""
