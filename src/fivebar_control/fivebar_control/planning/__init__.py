# SPDX-License-Identifier: Apache-2.0
"""Plans and screens motions: what a motion has to keep, whether it does, and the search for one that does."""
