# SPDX-License-Identifier: Apache-2.0
"""The add-on's tables are what this package would write now."""

from __future__ import annotations

from rfgs_core.sync import TABLES_PATH, text


def test_tables_of_the_add_on_are_in_sync() -> None:
    assert TABLES_PATH.read_text("utf-8") == text(), "run `make sync`"
