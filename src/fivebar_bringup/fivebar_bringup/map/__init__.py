# SPDX-License-Identifier: Apache-2.0
"""Maps of a robot's workspace and singularities, in the plane of the platform and in that of the motors."""
