# SPDX-License-Identifier: Apache-2.0
"""The first numbers of a report, each beside the strongest baseline there is, in plain words."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from rfgs_core.evaluate.residual import GAUSSIANS_ALONE
from rfgs_core.report.page import Card
from rfgs_core.report.tables import show

#: What each baseline does, for readers who have not met it.
WORDS = {
    "body_prior": "a body-shaped guess at the place found",
    "template": "a standing figure at our own place",
    "template_filled": "a solid standing figure at our own place",
    "matched_filter": "a plain radar image",
    "matched_filter_all_sum": "a plain radar image of all links",
    "matched_filter_all_log_mean": "a radar image of all links, averaged in dB",
    "matched_filter_different_sum": "a radar image of links between devices",
    "matched_filter_different_log_mean": "a radar image of links between devices, averaged in dB",
    "clean": "the echoes found one by one (CLEAN)",
    "omp": "the echoes found one by one (OMP)",
    "fista": "the fewest points that explain the echoes (FISTA)",
    "nnls": "a radar image without its blur (NNLS)",
    "music": "a radar image of high resolution (MUSIC)",
    "empty_room": "the empty room",
    "zero": "nothing at all",
    "nearest_element": "the nearest antenna that was heard",
    "linear": "a straight line between antennas",
    "gaussian_process": "a Gaussian process between antennas",
    "spectrum": "kriging by angle and delay spectra",
    "silhouette": "the true outline filled with one colour",
    "oracle_init": "our fit started on the truth",
}
#: Metrics in the words of their cards.
_METRICS = {
    "F5": "match within 5 cm (F5)",
    "F10": "match within 10 cm (F10)",
    "psnr_person": "pictures of the person (PSNR)",
}
#: No competitors: the fit that starts on the truth, and a part of the method itself.
_NO_BASELINES = ("oracle_init", GAUSSIANS_ALONE)


def strongest(metrics: Mapping[str, Any], group: str, key: str) -> tuple[str, float] | None:
    """The baseline with the highest value of a metric, and that; None if none has one."""
    known = {
        name: part[group][key]
        for name, part in metrics["baselines"].items()
        if name not in _NO_BASELINES and (part.get(group) or {}).get(key) is not None
    }
    best = max(sorted(known), key=lambda name: known[name], default=None)
    return None if best is None else (best, known[best])


def headline_cards(metrics: Mapping[str, Any]) -> list[Card]:
    """Shape at two distances, place, prediction, and what it took."""
    cards = [_shape(metrics, "f10", 10), _shape(metrics, "f05", 5), _place(metrics)]
    cards += _unseen(metrics)
    train_s = metrics["train_s"]
    time = f"trained in {train_s:.0f} s" if train_s is not None else "training time not recorded"
    cards.append(Card(f"{metrics['n_gaussians']:,}".replace(",", " "), "Gaussians", time))
    return cards


def _shape(metrics: Mapping[str, Any], key: str, distance_cm: int) -> Card:
    own, best = metrics["geometry"][key], strongest(metrics, "geometry", key)
    label = f"match with the true moving surface, within {distance_cm} cm (F{distance_cm})"
    note, verdict = "no baseline could be computed", ""
    if best is not None:
        note = f"strongest baseline: {show(100 * best[1], 0)} %, {_said(best[0])}"
        verdict = "won" if own > best[1] else "lost"
    ceiling = ((metrics["baselines"].get("oracle_init") or {}).get("geometry") or {}).get(key)
    if ceiling is not None:
        note += f"; started on the truth: {show(100 * ceiling, 0)} %"
    return Card(f"{show(100 * own, 0)} %", label, note, verdict)


def _place(metrics: Mapping[str, Any]) -> Card:
    people, own = metrics.get("people"), metrics["geometry"]
    if people is None or people["found"] is None:
        found = f"within half a metre in {show(100 * own['tracked'], 0)} % of the frames"
        return Card(_cm(own["centroid_m"]), "from the true position", found)
    found = f"{show(100 * people['found'], 0)} % of the people are found"
    return Card(_cm(people["centroid_m"]), "from each true position", found)


def _cm(far_m: float | None) -> str:
    return "–" if far_m is None else f"{show(100 * far_m, 0)} cm"


def _unseen(metrics: Mapping[str, Any]) -> list[Card]:
    """Prediction of channels; arrays of two columns have none to hold out."""
    own, best = metrics["rf"]["element_snr_db"], strongest(metrics, "rf", "element_snr_db")
    if own is None or best is None:
        return []
    note = f"strongest baseline: {show(best[1], 1)} dB, {_said(best[0])}"
    label = "SNR of the signal predicted at antennas it never heard"
    return [Card(f"{show(own, 1)} dB", label, note, "won" if own > best[1] else "lost")]


def in_words(sentence: str) -> str:
    """A sentence with what each baseline does before its name, and what a metric is called."""
    names = "|".join(sorted(WORDS, key=len, reverse=True))
    for metric, words in _METRICS.items():
        sentence = re.sub(rf"^{metric}\b", words, sentence)
    return re.sub(rf"\b(?:{names})\b", lambda found: _said(found[0]), sentence)


def _said(name: str) -> str:
    return f"{WORDS[name]} ({name})" if name in WORDS else name
