# SPDX-License-Identifier: Apache-2.0
"""Attacks formats in a process of its own: `attack.py FOLDER COUNT SEED [FORMAT…]` writes JSON.

`add-on` in place of formats attacks what the add-on reads, which takes bpy.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import random
import signal
import sys
import time
import traceback
import warnings
from collections import Counter
from pathlib import Path
from typing import Any, NoReturn

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "tests/attacks")]

import rfgs_core  # noqa: E402, F401

# isort: split
from bundle_formats import make_bundle  # noqa: E402
from formats import Format, digest, make_all  # noqa: E402
from other_formats import make_others  # noqa: E402
from people_formats import make_people  # noqa: E402

from dataset_factory.check.validate import checksum_faults  # noqa: E402
from rfgs_core.errors import RfgsError  # noqa: E402

#: Whatever takes longer is a hang [s].
LIMIT_S = 10.0


class Hang(BaseException):
    """The reader has not answered in time."""


def attack(form: Format, count: int, seed: int) -> dict[str, Any]:
    """Damages a file again and again, and counts what its reader makes of that."""
    state = random.Random(f"{seed} {form.name}")
    sound = {form.file: form.file.read_bytes()}
    if form.dataset:
        sound[form.dataset / "dataset.json"] = (form.dataset / "dataset.json").read_bytes()
    expected = digest(form.read())
    counts: Counter[str] = Counter()
    faults, slowest = [], 0.0
    for number in range(count):
        damaged = form.mutate(sound[form.file], state)
        form.file.write_bytes(damaged)
        if form.seal is not None:
            form.seal()
        begin = time.perf_counter()
        outcome, why = _outcome(form, expected)
        slowest = max(slowest, time.perf_counter() - begin)
        counts[outcome] += 1
        if outcome not in ("refused", "same", "found", "theirs"):
            keep = form.file.parent.parent / f"fault-{form.name.replace(' ', '-')}-{number}"
            faults.append(f"{outcome}: {why}")
            if os.environ.get("KEEP_FAULTS"):
                keep.write_bytes(damaged)
        for file, data in sound.items():
            file.write_bytes(data)
    return {"counts": counts, "faults": faults[:5], "slowest_s": round(slowest, 2)}


def _outcome(form: Format, expected: str) -> tuple[str, str]:
    signal.setitimer(signal.ITIMER_REAL, LIMIT_S)
    try:
        found = digest(form.read())
        if found == expected:
            return "same", ""
        if form.theirs:
            return "theirs", ""
        # Checksums of a dataset tell what no reader can: another value that could be right.
        if form.dataset is None:
            return "unnoticed", ""
        if form.name.endswith("manifest"):
            return "found", ""
        return ("found", "") if checksum_faults(form.dataset) else ("unnoticed", "")
    except Exception as error:
        if not isinstance(error, RfgsError) and type(error).__name__ != "AddonError":
            return "crash", traceback.format_exc()[-900:]
        text = str(error)
        return ("refused", "") if "\n" not in text and len(text) < 1500 else ("long", text)
    except Hang:
        return "hang", traceback.format_exc()[-600:]
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)


def _hang(*_: Any) -> NoReturn:
    raise Hang


def _formats(folder: Path, names: list[str]) -> list[Format]:
    if names != ["add-on"]:
        made = [*make_all(folder), *make_bundle(folder / "bundle")]
        made += make_people(folder / "people")
        return [*made, *make_others(folder / "others", folder / "run", folder / "bundle")]
    from addon_formats import make_addon

    return make_addon(folder)


def main() -> None:
    """Prints what happened to each format, and how much memory the process took."""
    folder, count, seed, *names = sys.argv[1:]
    signal.signal(signal.SIGALRM, _hang)
    warnings.simplefilter("ignore")
    result = {}
    with contextlib.redirect_stderr(io.StringIO()):
        formats = _formats(Path(folder), names)
        before = {file for file in Path(folder).parent.rglob("*") if file.is_file()}
        for form in formats:
            if not names or names == ["add-on"] or form.name in names:
                result[form.name] = attack(form, int(count), int(seed))
        after = {file for file in Path(folder).parent.rglob("*") if file.is_file()}
    # Not of getrusage, whose high-water mark counts the process that started this one.
    status = Path("/proc/self/status").read_text()
    peak = int(status.split("VmHWM:")[1].split()[0]) / 2**20
    written = sorted(map(str, after ^ before))
    sys.stdout.write(json.dumps({"formats": result, "peak_gib": peak, "written": written}) + "\n")


if __name__ == "__main__":
    main()
