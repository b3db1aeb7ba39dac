"""Waves of creeping rays: on the body, near it and far from it, one by one, summed, and as beams."""
