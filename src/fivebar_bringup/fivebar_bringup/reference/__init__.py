# SPDX-License-Identifier: Apache-2.0
"""Generated pages and schemas of the documentation."""
