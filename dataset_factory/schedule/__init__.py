# SPDX-License-Identifier: Apache-2.0
"""Who traces which frame: worker processes of this machine or of a Dask cluster."""
