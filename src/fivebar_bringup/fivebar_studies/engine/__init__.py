# SPDX-License-Identifier: Apache-2.0
"""The engine of all studies: cases shared among processes or machines, rows in files that can be resumed, a page."""
