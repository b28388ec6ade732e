# SPDX-License-Identifier: Apache-2.0
"""The steps of a commissioning, each a function of its session that finds something out or closes the gate."""
