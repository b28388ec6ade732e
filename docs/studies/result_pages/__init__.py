# SPDX-License-Identifier: Apache-2.0
"""The page of results in docs/results: which studies are run for them, and their data, tables and figures."""
