# SPDX-License-Identifier: Apache-2.0
"""What stands still: learned from the frames, and as Gaussians of its own."""
