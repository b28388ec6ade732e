# SPDX-License-Identifier: Apache-2.0
"""How likely a motion is to succeed: robots drawn within their tolerances, run on the compiled engine."""
