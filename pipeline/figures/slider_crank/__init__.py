"""Figures of chapter 4, the slider-crank with an unknown load on its slider; see `pipeline.figures`."""
