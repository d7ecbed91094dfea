# SPDX-License-Identifier: Apache-2.0
"""`python -m rfgs_core.cli`: the same as the `rfgs` command."""

from __future__ import annotations

import sys

from rfgs_core.cli import main

sys.exit(main())
