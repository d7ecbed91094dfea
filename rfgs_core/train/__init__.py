# SPDX-License-Identifier: Apache-2.0
"""Training: from the channel of a sequence to Gaussians, frame by frame."""
