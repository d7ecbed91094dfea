# SPDX-License-Identifier: Apache-2.0
"""The study: scenes x conditions x radios x seeds, each trained and held against its baselines."""
