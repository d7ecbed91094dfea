# SPDX-License-Identifier: Apache-2.0
"""What a trained run says of radios and matter: channels at new positions, echoes, materials."""

from __future__ import annotations

from rfgs_core.predict.prediction import Prediction, predict_channel

__all__ = ["Prediction", "predict_channel"]
