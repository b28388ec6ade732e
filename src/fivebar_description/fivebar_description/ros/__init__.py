# SPDX-License-Identifier: Apache-2.0
"""Both ends of a topic: quality of service, packing and checking of messages, the executor, parameters."""
