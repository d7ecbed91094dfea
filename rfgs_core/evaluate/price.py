# SPDX-License-Identifier: Apache-2.0
"""What an evaluation takes, before it begins."""

from __future__ import annotations

from dataclasses import replace

from rfgs_core.evaluate.baselines import BASELINES
from rfgs_core.evaluate.oracle import MOST_FRAMES
from rfgs_core.evaluate.scene import EvaluatedRun
from rfgs_core.past import Speed, Stage, count_in_words, forecast, in_words, size_in_words
from rfgs_core.run.costs import stages as training_stages

#: Time before the first frame, and of a frame of Wi-Fi with all baselines, on two cores of an AMD
#: EPYC, 2026-11-24: `rfgs eval` of the README's quick start.
USUAL = Speed(4.0, 4.3)
#: Entries of its channel: 4 x 256 antenna elements and 64 subcarriers.
USUAL_ENTRIES = 4 * 256 * 64
#: A picture of 128 x 128 pixels [s], there.
USUAL_PICTURE_S = 0.2
#: `metrics.json` of a frame [B].
BYTES_PER_FRAME = 14_000.0


def frames_stage(run: EvaluatedRun) -> Stage:
    """Every frame of a run, with all baselines."""
    radio = run.config.radio
    measured = run.sequence.layout(radio).measured
    entries = measured.size * run.sequence.radio_spec(radio).num_subcarriers
    what = [radio, measured.shape, entries, run.config.settings.observe]
    usual = Speed(USUAL.start_s, USUAL.step_s * entries / USUAL_ENTRIES)
    return Stage("evaluate", "eval", what, len(run.frames), usual)


def price_line(run: EvaluatedRun, pictures: int, *, oracle: bool) -> str:
    """One line before an evaluation: how much of what, how long, and what would be less.

    Args:
        run: The run.
        pictures: Pictures that it is held against.
        oracle: Whether the fit is started on the true surface as well.
    """
    frames, what = len(run.frames), [run.config.radio]
    stages = [
        frames_stage(run),
        Stage("pictures", "eval-pictures", what, pictures, Speed(0.0, USUAL_PICTURE_S)),
    ]
    if oracle:
        ceiling = min(frames, MOST_FRAMES)
        fits = training_stages(run.config, run.sequence, ceiling, run.config.settings.iterations)
        stages += [replace(fit, name="oracle_init") for fit in fits if fit.name != "find"]
    found = forecast(stage for stage in stages if stage.steps)
    fits = f", {min(frames, MOST_FRAMES)} fits from the true surface" if oracle else ""
    less = "; --no-oracle is less" if oracle else ""
    return (
        f"{count_in_words(frames, 'frame')} beside {len(BASELINES)} baselines, {pictures} "
        f"pictures{fits}; about {size_in_words(frames * BYTES_PER_FRAME)}; about "
        f"{in_words(found.total_s)}, {found.source}{less}"
    )
