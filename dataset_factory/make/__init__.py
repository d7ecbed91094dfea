# SPDX-License-Identifier: Apache-2.0
"""Makes a dataset stage by stage."""
