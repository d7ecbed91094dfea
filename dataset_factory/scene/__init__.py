# SPDX-License-Identifier: Apache-2.0
"""A scene as the factory knows it: read from Blender, with what a user and a radio say of it."""
