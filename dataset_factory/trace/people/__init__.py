# SPDX-License-Identifier: Apache-2.0
"""What everything that moves scatters: points on its skin, and their facets."""
