# SPDX-License-Identifier: Apache-2.0
"""What facets scatter between arrays, by gridding in delay."""
