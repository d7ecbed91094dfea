# SPDX-License-Identifier: Apache-2.0
"""Propagation paths between sites, and the channel of every antenna element."""
