# SPDX-License-Identifier: Apache-2.0
"""`rfgs-factory verify`."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

from dataset_factory.plan.tracers import TracerName


@dataclass(frozen=True)
class VerifyArgs:
    """Holds the simulation against closed forms of physics, each in a scene of its own.

    Every scene goes the way of any other: built in Blender, exported by the add-on, traced. Prints
    each closed form beside what came out, and writes a page with plots. Exit code 1 if a row
    misses its tolerance. Two to four minutes on two cores; `--only friis` takes a quarter of one.
    Groups: friis, box, reciprocity, targets, shadow, doppler, delay, energy, pictures,
    convergence.
    """

    only: tuple[str, ...] = ()
    """Groups to verify, several in a row; default: all."""
    tracer: TracerName = "sionna"
    """Which tracer: Sionna RT, or the fast one, which has no antennas that move and no tables of
    paths."""
    out: Path = Path("physics")
    """Folder that gets index.html (with plots), physics.md and card.json."""
    markdown: Path | None = None
    """Also write the Markdown page to this file, as `docs/physics.md`."""


def run(args: VerifyArgs) -> int:
    """Prints the card; returns 1 if a row misses."""
    from dataset_factory.verify import chosen_groups

    chosen_groups(args.only)
    from tqdm import tqdm

    from dataset_factory.trace.setup import prepare
    from dataset_factory.verify import GROUPS, verify
    from dataset_factory.verify.report import as_markdown, as_text, facts, summary, write_card
    from rfgs_core.extras import require
    from rfgs_core.files import refuse_place, write_text

    require("sionna", "bpy")
    if args.markdown is not None:
        refuse_place(args.markdown)
    prepare()
    usual_s = sum(GROUPS[name] for name in chosen_groups(args.only))
    args.out.mkdir(parents=True, exist_ok=True)
    form = "{desc}: {percentage:3.0f}%|{bar}| {elapsed}<{remaining}"
    with tqdm(total=usual_s, bar_format=form) as bar:

        def done(name: str, seconds: float) -> None:
            bar.set_description_str(name or "done", refresh=False)
            bar.update(seconds)
            bar.refresh()

        card = verify(args.only, args.out, done, args.tracer)
    card.facts = facts(_command(args), card)
    sys.stdout.write(as_text(card))
    write_card(card, args.out)
    if args.markdown is not None:
        write_text(args.markdown, as_markdown(card))
    sys.stdout.write(f"wrote {args.out / 'index.html'}\n")
    if card.missed:
        sys.stderr.write(f"verify: {summary(card)}\n")
    return 1 if card.missed else 0


def _command(args: VerifyArgs) -> str:
    """The command line that makes the same card again."""
    only = ["--only", *args.only] if args.only else []
    only += ["--tracer", args.tracer] if args.tracer != "sionna" else []
    markdown = ["--markdown", str(args.markdown)] if args.markdown else []
    return " ".join(["rfgs-factory verify", *only, *markdown])
