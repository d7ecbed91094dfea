# SPDX-License-Identifier: Apache-2.0
"""Whatever somebody does, by evidence alone: poses out of random motions, bred frame by frame."""
