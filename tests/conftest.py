# SPDX-License-Identifier: Apache-2.0
"""Shape checks at run time for every test: jaxtyping annotations are enforced by beartype."""

from __future__ import annotations

from jaxtyping import install_import_hook

# Packages with numba kernels are left out: the hook would wrap a kernel that calls another, and
# numba's cache cannot store the wrapper.
install_import_hook(["rfgs_core.radio", "rfgs_core.gaussians"], "beartype.beartype")
