"""The cam-follower of chapters 5 and 6: mechanism, models and their training."""
