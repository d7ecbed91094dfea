# SPDX-License-Identifier: Apache-2.0
"""The study's table as Markdown, for the terminal and for documents."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rfgs_core.study.cases import CONDITIONS
from rfgs_core.study.summary import INTERPOLATORS, Row

_HEAD = (
    "scene", "radio", "condition", "seeds", "F5", "F10", "± seeds", "best baseline F10",
    "error cut", "gap closed", "template F5/F10", "prior F10", "ceiling F10", "centroid [m]",
    "found", "identity", "elements [dB]", "linear/GP/spectrum [dB]", "pair level [dB]", "profiles",
    "missed",
)  # fmt: skip

_NOTES = """\
F5, F10: F-score at 5 and 10 cm, mean over frames and seeds. Best baseline: the best of matched
filter, CLEAN, OMP, FISTA, NNLS and MUSIC. Error cut: share of that one's 1 − F10 that is removed,
or by how much the error is larger; gap closed: share of the way from it to `oracle_init`, the same
fit started on the true surface, or by how much the gap is wider. Prior: what the start of the
fit assumes of bodies, at the places and in the postures found. Centroid: of each person against
the body found; found: share of people with it within half a metre; identity: share of bodies that
stay with the person they were with at first. Elements: complex SNR on
unseen array columns of csi − csi_static, beside three ways to interpolate. Pair level: error of an
unseen device pair's mean power; profiles: correlation of the delay profiles of unseen links; both
beside the best baseline. Missed: targets that were set before and are not reached."""


def study_table(rows: Sequence[Row], failed: Mapping[str, str] | None = None) -> str:
    """All rows, then what the columns and conditions mean, and why cases by name have failed."""
    lines = [f"| {' | '.join(_HEAD)} |", "|" + "---|" * len(_HEAD)]
    lines += [f"| {' | '.join(_cells(row))} |" for row in rows]
    shown = dict.fromkeys(row.condition for row in rows)
    conditions = [f"- {name}: {CONDITIONS[name].label}" for name in shown]
    lines += ["", _NOTES, "", *conditions, ""]
    if failed:
        lines += ["Failed, and in no row:", ""]
        lines += [f"- {name}: {why}" for name, why in failed.items()]
        lines.append("")
    return "\n".join(lines)


def _cells(row: Row) -> list[str]:
    v = row.values
    missed = [name.replace("_", " ") for name, reached in row.targets.items() if reached is False]
    return [
        *(row.scene, row.radio, row.condition, str(row.seeds)),
        *(number(v["f05"]), number(v["f10"]), f"{row.spread_f10:.3f}"),
        f"{number(v['image_f10'])} ({row.best_image})",
        *(_percent(v["cut"], "larger"), _percent(v["gap"], "wider")),
        f"{number(v['template_f05'])} / {number(v['template_f10'])}",
        *(number(v["prior_f10"]), number(v["oracle_f10"]), number(v["centroid_m"])),
        *(number(v["found"], ".2f"), number(v["identity_kept"], ".2f")),
        number(v["element_snr_db"], ".1f"),
        " / ".join(number(v[f"{name}_snr_db"], ".1f") for name in INTERPOLATORS),
        _beside(v, "device_gain_mae_db", row.best_gain, ".1f"),
        _beside(v, "delay_profile_corr", row.best_profile, ".2f"),
        ", ".join(missed) or "none",
    ]


def _beside(values: Mapping[str, float | None], key: str, baseline: str, form: str) -> str:
    """The method's value, and the best baseline's in brackets."""
    own = number(values[key], form)
    return f"{own} ({number(values[f'baseline_{key}'], form)} {baseline})" if baseline else own


def number(value: float | None, form: str = ".3f") -> str:
    """A cell of a table; a dash where there is no value."""
    return "–" if value is None else format(value, form)


def _percent(value: float | None, grown: str) -> str:
    """A share that went; where it grew instead, by how much and the word for it."""
    if value is None:
        return "–"
    return f"{100 * value:.0f} %" if value >= 0.0 else f"{-100 * value:.0f} % {grown}"
