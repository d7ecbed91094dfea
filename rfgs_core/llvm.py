# SPDX-License-Identifier: Apache-2.0
"""Finds an LLVM library that Dr.Jit can use, before Sionna RT is imported."""

from __future__ import annotations

import ctypes
import os
import re
from pathlib import Path

from rfgs_core.errors import MissingToolError

#: LLVM 15 crashes code generation on processors with AVX-512, so older ones are not used.
OLDEST_USABLE = 16

REMEDY = (
    "install one with `apt-get install libllvm19` (Debian, Ubuntu) or point DRJIT_LIBLLVM_PATH "
    "at a libLLVM shared library of version 16 or newer"
)

_FOLDERS = ("/usr/lib/x86_64-linux-gnu", "/usr/lib/aarch64-linux-gnu", "/usr/lib64", "/usr/lib")


def version_of(library: Path) -> int:
    """Major version of an LLVM shared library, 0 when it cannot be loaded.

    Libraries before LLVM 16 do not export `LLVMGetVersion`; their file name tells.
    """
    try:
        handle = ctypes.CDLL(str(library))
    except OSError:
        return 0
    if not hasattr(handle, "LLVMGetVersion"):
        digits = re.search(r"(\d+)", library.resolve().name.removeprefix("libLLVM"))
        return int(digits.group(1)) if digits else 0
    major, minor, patch = ctypes.c_uint(), ctypes.c_uint(), ctypes.c_uint()
    handle.LLVMGetVersion(ctypes.byref(major), ctypes.byref(minor), ctypes.byref(patch))
    return major.value


def candidates() -> list[Path]:
    """LLVM libraries on this machine in usual places, one per real file."""
    found = {
        path.resolve()
        for folder in (*_FOLDERS, *(str(p) for p in Path("/usr/lib").glob("llvm-*/lib")))
        for path in Path(folder).glob("libLLVM*.so*")
    }
    return sorted(found)


def use_llvm() -> tuple[Path, int]:
    """Chooses the newest usable LLVM and tells Dr.Jit through the environment.

    Call before importing drjit, mitsuba or sionna. A library named by the user in
    DRJIT_LIBLLVM_PATH is taken as it is, if it is new enough.

    Returns:
        Path and major version of the library.

    Raises:
        MissingToolError: There is none, or only versions that crash.
    """
    named = os.environ.get("DRJIT_LIBLLVM_PATH")
    paths = [Path(named)] if named else candidates()
    versions = {path: version_of(path) for path in paths}
    usable = {path: version for path, version in versions.items() if version >= OLDEST_USABLE}
    if not usable:
        seen = ", ".join(f"{path.name} (version {v})" for path, v in versions.items() if v)
        where = f"DRJIT_LIBLLVM_PATH={named}" if named else "this machine"
        problem = f"LLVM is too old on {where}: {seen}" if seen else f"no LLVM found on {where}"
        raise MissingToolError(
            f"{problem}; Sionna RT needs version {OLDEST_USABLE} or newer: {REMEDY}"
        )
    best = max(usable, key=lambda path: usable[path])
    os.environ["DRJIT_LIBLLVM_PATH"] = str(best)
    return best, usable[best]
