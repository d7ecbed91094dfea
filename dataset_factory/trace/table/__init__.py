# SPDX-License-Identifier: Apache-2.0
"""Path tables: what stands behind a channel."""
