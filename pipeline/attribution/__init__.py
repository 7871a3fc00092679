"""Compute the contribution of each input of a network to a predicted follower jump (section 5.5)."""
