"""What both ends of a topic share: quality of service, packing and checking of messages, the executor, parameters."""
