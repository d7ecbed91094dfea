# SPDX-License-Identifier: Apache-2.0
"""`python -m dataset_factory`, the same as `rfgs-factory`."""

from __future__ import annotations

import sys

from dataset_factory.cli import main

sys.exit(main())
