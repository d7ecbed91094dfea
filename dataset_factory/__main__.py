# SPDX-License-Identifier: Apache-2.0
"""`rfgs-factory`, and `python -m dataset_factory`, which is the same."""

from __future__ import annotations

from rfgs_core.interrupts import run_program


def main() -> None:
    """Entry point; does not return."""
    run_program("dataset_factory.cli")


if __name__ == "__main__":
    main()
