# SPDX-License-Identifier: Apache-2.0
"""What stands between places: still things looked at once, bodies rasterised in every frame."""
