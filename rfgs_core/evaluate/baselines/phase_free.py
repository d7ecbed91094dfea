# SPDX-License-Identifier: Apache-2.0
"""What baselines may answer where the radio reports no phases: the evidence training had."""

from __future__ import annotations

from rfgs_core.evaluate.evidence import Baseline, BaselineResult, Evidence
from rfgs_core.settings import Observe

#: Baselines that say nothing but a channel, which takes the channel's phases to interpolate.
_CHANNEL_ONLY = ("nearest_element", "linear", "gaussian_process", "spectrum")
#: Baselines that add up waves; a hologram of powers per subcarrier still has some, delays have
# none.
_COHERENT = ("clean", "omp", "fista", "nnls", "music")
#: Predict that nothing changed or arrives, whatever is reported.
_SILENT = ("zero", "empty_room")


def answer(name: str, baseline: Baseline, evidence: Evidence, observe: Observe) -> BaselineResult:
    """The baseline's result, or why it has none.

    Of powers per subcarrier, baselines see the hologram that training sees and keep their geometry;
    a channel fitted to a hologram is no channel. Of powers per delay, the matched filter is that
    without phases.
    """
    if observe == "complex":
        return baseline(evidence)
    why = f"the radio reports {observe}, without the phases that this baseline needs"
    if name in _CHANNEL_ONLY or (observe == "delay_power" and name in _COHERENT):
        return BaselineResult(reason=why)
    result = baseline(evidence)
    if name in _SILENT:
        return BaselineResult(score=result.score, delta=result.delta)
    return BaselineResult(score=result.score, reason=result.reason or why)
