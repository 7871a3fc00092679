"""Figures of sections 5.4 and 5.5, predicted follower jumps and their reasons; see `pipeline.figures`."""
