# SPDX-License-Identifier: Apache-2.0
"""What one frame's radio reports: read, cleaned of noise and offsets, less what is held out."""
