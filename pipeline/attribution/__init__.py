"""Compute the contribution of each input of the recurrent network to a predicted follower jump (section 5.5)."""
