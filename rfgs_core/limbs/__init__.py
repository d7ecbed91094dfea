# SPDX-License-Identifier: Apache-2.0
"""Limbs of people from radio alone: a network that proposes poses, smoothed and put on a body."""
