"""The diffracted field along creeping rays: on the body, near it, far from it."""
