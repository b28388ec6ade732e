# SPDX-License-Identifier: Apache-2.0
"""Robot files that are made from answers to questions."""
