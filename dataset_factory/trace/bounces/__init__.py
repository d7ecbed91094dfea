# SPDX-License-Identifier: Apache-2.0
"""What people scatter by way of walls."""
