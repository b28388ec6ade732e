# SPDX-License-Identifier: Apache-2.0
"""State estimation from motor encoders and applied torques, and the check by the IMU."""
