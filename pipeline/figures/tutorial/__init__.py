"""Figures of the tutorial, chapter 2; see `pipeline.figures`."""
