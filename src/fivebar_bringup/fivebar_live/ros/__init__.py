# SPDX-License-Identifier: Apache-2.0
"""The live page's subscriptions to a running graph, and the services that it calls."""
