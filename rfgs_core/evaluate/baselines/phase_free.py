# SPDX-License-Identifier: Apache-2.0
"""What controls may answer where the radio reports no phases: the evidence training had."""

from __future__ import annotations

from rfgs_core.evaluate.evidence import Control, ControlResult, Evidence
from rfgs_core.settings import Observe

#: Controls that say nothing but a channel, which takes the channel's phases to interpolate.
_CHANNEL_ONLY = ("nearest_element", "linear", "gaussian_process", "spectrum")
#: Controls that add up waves; a hologram of powers per tone still has some, delays have none.
_COHERENT = ("clean", "omp")
#: Predict that nothing changed or arrives, whatever is reported.
_SILENT = ("zero", "empty_room")


def answer(name: str, control: Control, evidence: Evidence, observe: Observe) -> ControlResult:
    """The control's result, or why it has none.

    Of powers per tone, controls see the hologram that training sees and keep their geometry; a
    channel fitted to a hologram is no channel. Of powers per delay, the matched filter is that
    without phases.
    """
    if observe == "complex":
        return control(evidence)
    why = f"the radio reports {observe}, without the phases that this control needs"
    if name in _CHANNEL_ONLY or (observe == "delay_power" and name in _COHERENT):
        return ControlResult(reason=why)
    result = control(evidence)
    if name in _SILENT:
        return ControlResult(score=result.score, delta=result.delta)
    return ControlResult(score=result.score, reason=result.reason or why)
