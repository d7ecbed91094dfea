# SPDX-License-Identifier: Apache-2.0
"""Work spread over processes of this machine, or over a Dask cluster."""
