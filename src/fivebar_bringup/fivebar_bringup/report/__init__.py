# SPDX-License-Identifier: Apache-2.0
"""From a recorded run to figures, a page and a summary."""
