# SPDX-License-Identifier: Apache-2.0
"""YAML files that people write: names and values, read as they look."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import yaml
from yaml.composer import ComposerError
from yaml.constructor import ConstructorError

from rfgs_core.errors import RfgsError, RfgsFormatError
from rfgs_core.links import refuse_link

#: Largest file that is read [bytes]; people write a few kB.
_LARGEST_BYTES = 2**22


class _Loader(yaml.SafeLoader):
    """YAML 1.2 scalars only: `1:30` is no number in base 60, `on` is no truth; no key twice.

    No aliases either: none is needed, and a few nested ones make a file of terabytes.
    """

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        if self.check_event(yaml.AliasEvent):
            event = self.peek_event()
            raise ComposerError(None, None, f"found the alias {event.anchor!r}", event.start_mark)
        return super().compose_node(parent, index)


_Loader.yaml_implicit_resolvers = {}
for _tag, _form, _first in (
    ("null", r"~|null|", [*"~n", ""]),
    ("bool", r"true|false", [*"tf"]),
    ("int", r"[-+]?[0-9]+", [*"-+0123456789"]),
    ("float", r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?", [*"-+.0123456789"]),
):
    _Loader.add_implicit_resolver(f"tag:yaml.org,2002:{_tag}", re.compile(f"({_form})$"), _first)


def _construct_mapping(loader: _Loader, node: yaml.MappingNode) -> dict[Any, Any]:
    pairs = [
        (loader.construct_object(k, True), loader.construct_object(v, True)) for k, v in node.value
    ]
    keys = [key for key, _ in pairs]
    for key in keys:
        if not isinstance(key, str):
            problem = f"expected a name before the colon, got {key!r}"
            raise ConstructorError(None, None, problem, node.start_mark)
        if keys.count(key) > 1:
            raise ConstructorError(None, None, f"the key {key!r} stands twice", node.start_mark)
    return dict(pairs)


def _construct_int(loader: _Loader, node: yaml.ScalarNode) -> int:
    return int(loader.construct_scalar(node))  # SafeLoader takes 010 for 8.


_Loader.add_constructor("tag:yaml.org,2002:map", _construct_mapping)
_Loader.add_constructor("tag:yaml.org,2002:int", _construct_int)


def read_yaml(path: Path) -> Any:
    """Reads a YAML file.

    Raises:
        RfgsError: There is no such file, or it cannot be read.
        RfgsFormatError: The file is no YAML; the message names the line.
    """
    refuse_link(path)
    try:
        if path.stat().st_size > _LARGEST_BYTES:
            raise RfgsFormatError(f"{path}: larger than any YAML file of ours")
        return yaml.load(path.read_text("utf-8"), Loader=_Loader)
    except FileNotFoundError as error:
        raise RfgsError(f"{path}: no such file") from error
    except OSError as error:
        raise RfgsError(f"{path}: cannot be read ({error.strerror})") from error
    except UnicodeDecodeError as error:
        raise RfgsFormatError(f"{path}: cannot be read, expected a YAML text file") from error
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        line = f", line {mark.line + 1}" if mark else ""
        reason = getattr(error, "problem", None) or "not text"
        remedy = "; put names that begin with * in quotes" if "alias" in str(error) else ""
        raise RfgsFormatError(f"{path}: no valid YAML{line}: {reason}{remedy}") from error
    except RfgsFormatError:
        raise
    except (ValueError, RecursionError) as error:
        raise RfgsFormatError(f"{path}: no valid YAML ({error})") from error
