"""Memory ports, and what joins and serves them."""
