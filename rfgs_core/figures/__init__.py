# SPDX-License-Identifier: Apache-2.0
"""Figures of reports, poses, predictions and previews, all in one style."""
