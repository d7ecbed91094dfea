# SPDX-License-Identifier: Apache-2.0
"""The forward model of a fit: from Gaussians to what the radio reports, and its first levels."""
