# SPDX-License-Identifier: Apache-2.0
"""The live page of a running graph: what it shows, what it accepts, and who may look.

For whoever stands beside a robot and wants to see and move it in a browser, on this machine only.
It stands on the topics of the graph and on the pages of `fivebar_bringup`.
`fivebar view` is found by an entry point of the group `fivebar.commands`, the option `--view` by one of
`fivebar.live_page`, and the node `viewer` is an executable; nothing else imports it.
"""
