# SPDX-License-Identifier: Apache-2.0
"""Neural fields fitted to radio: the rivals that the RF-GS paper compares with."""
