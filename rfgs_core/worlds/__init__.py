# SPDX-License-Identifier: Apache-2.0
"""Random rooms, radios and people, and what the radios hear of them: data to train networks on."""
