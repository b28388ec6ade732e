"""The live page's subscriptions to a running graph, and the services that it calls."""
