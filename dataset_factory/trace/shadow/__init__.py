# SPDX-License-Identifier: Apache-2.0
"""What bodies take from paths: Fresnel integrals over silhouettes."""
