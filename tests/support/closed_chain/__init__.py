# SPDX-License-Identifier: Apache-2.0
"""Planar closed chains in general (section 1.2 of the thesis), on top of a Pinocchio tree model.

A chain is cut at its platform: what remains of the legs is the *virtual tree*, and the platform is a free body. Two
sets of constraints join them, and with them the efforts of the tree and of the free platform give the torques:

- A t = B qdot_a (1.1), the loops with the passive velocities eliminated;
- J_t t - J_ta qdot_a = J_td qdot_d (1.6), what the passive joints do;
- tau = tau_ta + B^T lambda_1 - J_ta^T lambda_2 = tau_ta + J^T w_p + J_d^T tau_td (1.7, 1.15).

Sign convention of this project: **A t = B qdot_a**, J = A^-1 B. The thesis prints 1.1 as A t + B qdot_a = 0, which
turns the sign of B here, of B^T lambda_1 in 1.7 and of J in 1.26; its five-bar (1.16, 1.30) and the J beside 1.15 are
in the convention used here.

Frames and units: all vectors in the base frame, the plane is its xy plane; m, rad, s, kg, N, Nm. n is the number of
active joints and of platform freedoms, n_d the number of passive joints.
"""
