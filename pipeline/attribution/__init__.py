"""How much each input of the recurrent network adds to a predicted follower jump (section 5.5)."""
