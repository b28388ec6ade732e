# SPDX-License-Identifier: Apache-2.0
"""Parts that reports and studies share: page templates, tables, pictures and the style of figures."""
