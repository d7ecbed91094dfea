# SPDX-License-Identifier: Apache-2.0
"""Public sets of real people and radar: their readers, and our network held against them."""
