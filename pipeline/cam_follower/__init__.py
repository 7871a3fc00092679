"""The cam-follower of chapters 5 and 6: its mechanism, its models and their training."""
