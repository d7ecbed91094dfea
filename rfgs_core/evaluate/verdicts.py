# SPDX-License-Identifier: Apache-2.0
"""Plain sentences: what was won, what was lost, by how much, and why as far as can be told."""

from __future__ import annotations

from typing import Any

from rfgs_core.evaluate.residual import GAUSSIANS_ALONE

#: Beginnings of sentences; reports colour them.
WON, LOST, OPEN = "Won: ", "Lost: ", "Not decided: "
#: Share of the baseline's error 1 − F that the method must remove on radios between devices.
ERROR_SHARE = 1.0 / 3.0
#: What copying the nearest visible entry may explain of hidden ones [dB]. In our scenes it is 0.6
#: or less: a person's phase turns by more than a radian from one element to the next.
LEAK_DB = 3.0


def verdicts(metrics: dict[str, Any]) -> list[str]:
    """One sentence per required comparison, and one per further baseline that does better."""
    result = [_against(metrics, "matched_filter", "f10")]
    result += _error_share(metrics)
    result += [_against(metrics, "template", key) for key in ("f05", "f10")]
    for key in ("f05", "f10"):
        result += _other_geometry(metrics, key)
    result += [_nothing_found(metrics)]
    result += [_rf(metrics, key) for key in ("element_snr_db", "subcarrier_snr_db")]
    result += [_leak(metrics, key) for key in ("element_snr_db", "subcarrier_snr_db")]
    result += [_picture(metrics)]
    return [sentence for sentence in result if sentence]


def _value(metrics: dict[str, Any], group: str, key: str) -> float | None:
    return (metrics.get(group) or {}).get(key)


def _baseline(metrics: dict[str, Any], name: str, group: str, key: str) -> float | None:
    return _value(metrics["baselines"].get(name) or {}, group, key)


def _against(metrics: dict[str, Any], name: str, key: str) -> str:
    """Geometry against one baseline."""
    own, other = _value(metrics, "geometry", key), _baseline(metrics, name, "geometry", key)
    label = _label(key)
    if own is None or other is None:
        return f"{OPEN}{label} against {name}: one of the two could not be computed."
    numbers = f"{label} {own:.3f} against {other:.3f} of {name} ({own - other:+.3f})"
    if own > other:
        return f"{WON}{numbers}."
    return f"{LOST}{numbers}. {_why(metrics, key, other)}"


def _why(metrics: dict[str, Any], key: str, other: float) -> str:
    """What the evidence says about a lost comparison of geometry."""
    parts = []
    tracked = _value(metrics, "geometry", "tracked")
    if tracked is not None and tracked < 1.0:
        parts.append(
            f"In {100 * (1 - tracked):.0f} % of the frames the fit sits over half a metre away"
        )
    ceiling = _baseline(metrics, "oracle_init", "geometry", key)
    if ceiling is None:
        parts.append(
            "The ceiling oracle_init is not known, so model and optimisation cannot be separated"
        )
    elif ceiling <= other:
        parts.append(
            f"Even the fit started on the true surface reaches only {ceiling:.3f}, so the data "
            "and the model set the limit, not the optimisation"
        )
    else:
        parts.append(
            f"The fit started on the true surface reaches {ceiling:.3f} with the same data and "
            "model, so the optimisation is at fault"
        )
    cross, reach = metrics["limits"].get("cross_range_m"), metrics["limits"]["range_resolution_m"]
    if cross is not None:
        parts.append(f"The radio resolves {reach:.2f} m in range and {cross:.2f} m across")
    return ". ".join(parts) + "."


def _error_share(metrics: dict[str, Any]) -> list[str]:
    """Share of the matched filter's error removed, where devices hear each other."""
    between = _baseline(metrics, "matched_filter_different_sum", "geometry", "f10") is not None
    own = _value(metrics, "geometry", "f10")
    other = _baseline(metrics, "matched_filter", "geometry", "f10")
    if not between or own is None or other is None or other >= 1.0:
        return []
    share = (own - other) / (1.0 - other)
    full = "a full match (1 − F10)"
    text = f"{100 * share:.0f} % of what the radar image lacks to {full} is gained"
    if share < 0.0:
        text = f"{-100 * share:.0f} % more is lacking to {full} than with the radar image"
    if share >= ERROR_SHARE:
        return [f"{WON}{text}; the target is a third."]
    return [f"{LOST}{text}; the target is a third. {_why(metrics, 'f10', other)}"]


def _other_geometry(metrics: dict[str, Any], key: str) -> list[str]:
    """Further baselines with a better F-score; the ceiling is no competitor."""
    own = _value(metrics, "geometry", key)
    better = []
    for name in metrics["baselines"]:
        other = _baseline(metrics, name, "geometry", key)
        known = name in ("template", "oracle_init") or (name == "matched_filter" and key == "f10")
        if not known and own is not None and other is not None and other >= own:
            better.append(f"{name} ({other:.3f})")
    if not better or own is None:
        return []
    return [f"{LOST}{_label(key)} {own:.3f} against {', '.join(better)}."]


def _label(key: str) -> str:
    """F5 of f05."""
    return key.upper().replace("F0", "F")


def _nothing_found(metrics: dict[str, Any]) -> str:
    """That distances leave frames out, if they do; F-scores are zero there."""
    rows = [row.get("geometry") or {} for row in metrics.get("frames", [])]
    empty = sum(row.get("f10") is not None and row.get("centroid_m") is None for row in rows)
    if not empty:
        return ""
    return (
        f"{OPEN}in {empty} of {len(rows)} frames nothing was found; centroid, height and Chamfer "
        "distance are means over the others."
    )


def _rf(metrics: dict[str, Any], key: str) -> str:
    """Held-out channel entries against the best baseline."""
    own = _value(metrics, "rf", key)
    others = [name for name in metrics["baselines"] if name != GAUSSIANS_ALONE]
    values = {name: _baseline(metrics, name, "rf", key) for name in others}
    known = {name: value for name, value in values.items() if value is not None}
    what = "held-out elements" if key.startswith("element") else "held-out subcarriers"
    if own is None or not known:
        return ""
    best = max(known, key=lambda name: known[name])
    numbers = f"{own:.1f} dB on {what} against {known[best]:.1f} dB of {best}"
    if own > known[best]:
        return f"{WON}{numbers}, the best baseline."
    below = [name for name, value in known.items() if value >= own]
    smooth = ""
    if best in ("spectrum", "gaussian_process", "linear"):
        smooth = (
            " Clean channels are smooth along arrays and subcarriers, which suits interpolation; "
            "it says nothing about where the person is."
        )
    return f"{LOST}{numbers}; {len(below)} of {len(known)} baselines do at least as well.{smooth}"


def _leak(metrics: dict[str, Any], key: str) -> str:
    """Whether hidden entries are as good as shown."""
    value = _baseline(metrics, "nearest_element", "rf", key)
    return leak(value, "elements" if key.startswith("element") else "subcarriers")


def leak(nearest_db: float | None, what: str) -> str:
    """A sentence where the nearest visible entry is suspiciously good; else empty.

    Args:
        nearest_db: Signal over error of hidden entries, copied from the nearest visible one [dB].
        what: Which entries are hidden.
    """
    if nearest_db is None or nearest_db < LEAK_DB:
        return ""
    return (
        f"{OPEN}copying the nearest visible entry explains {nearest_db:.1f} dB of held-out {what}, "
        "so they are hardly hidden: the split leaks, or neighbours repeat one another. What is "
        "reached on them says little about a method."
    )


def _picture(metrics: dict[str, Any]) -> str:
    """The person in pictures against the silhouette, which is given the outline."""
    own = _value(metrics, "image", "psnr_person")
    other = _baseline(metrics, "silhouette", "image", "psnr_person")
    if own is None or other is None:
        return ""
    numbers = f"psnr_person {own:.1f} dB against {other:.1f} dB of silhouette"
    if own > other:
        return f"{WON}{numbers}."
    return f"{LOST}{numbers}, which is given the true outline. Pictures are a display only."
