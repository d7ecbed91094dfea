# SPDX-License-Identifier: Apache-2.0
"""The fit of Gaussians to one frame."""
