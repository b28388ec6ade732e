# SPDX-License-Identifier: Apache-2.0
"""Thousands of random crossings with every controller: success rates, errors and causes of failure."""
