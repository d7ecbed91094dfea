# SPDX-License-Identifier: Apache-2.0
"""The web viewer of a run: what a frame holds, how it is coloured, the page and its server."""
