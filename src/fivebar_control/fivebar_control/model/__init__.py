# SPDX-License-Identifier: Apache-2.0
"""The five-bar's kinematics, singularities and dynamics in closed-form scalars, in the thesis' notation.

Frames: base frame in the middle between the motor axes, x from motor 1 to motor 2, y towards the workspace.
Units: m, rad, s, kg, N, Nm. Leg i: active angle q_i1, passive relative angle q_i2, theta_i = q_i1 + q_i2.
The functions take and return floats and named tuples of floats only, without arrays or a linear algebra library: they
are fast enough for a 500 Hz loop in plain Python, and numba can compile them unchanged.
"""
