# SPDX-License-Identifier: Apache-2.0
"""`rfgs`, and `python -m rfgs_core.cli`, which is the same."""

from __future__ import annotations

from rfgs_core.interrupts import run_program


def main() -> None:
    """Entry point; does not return."""
    run_program("rfgs_core.cli")


if __name__ == "__main__":
    main()
