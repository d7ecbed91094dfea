# SPDX-License-Identifier: Apache-2.0
"""What a dataset promises, checked and counted."""
