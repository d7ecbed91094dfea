# SPDX-License-Identifier: Apache-2.0
"""The scene in Sionna RT, the paths that rays find in it, and their sum at every element."""
