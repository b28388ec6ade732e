# SPDX-License-Identifier: Apache-2.0
"""The simulated robot in MuJoCo: the mechanism with its effects, and its model as a file.

For whoever wants a second opinion on the plant: MuJoCo shares no equation with Pinocchio's robot or this project's.
It stands on the settings and the effects of `fivebar_sim`, which never import it.
`plant: {engine: mujoco}` finds it by an entry point of the group `fivebar.plants`, `fivebar model` by one of
`fivebar.models`.
"""
