# SPDX-License-Identifier: Apache-2.0
"""Pictures of Gaussians, for display: nothing here teaches the Gaussians anything."""
