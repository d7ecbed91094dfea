# SPDX-License-Identifier: Apache-2.0
"""Where people are, how they hold themselves and move, and the Gaussians drawn for that."""
