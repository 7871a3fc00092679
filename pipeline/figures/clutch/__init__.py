"""Figures of chapter 3, the wet clutch with uncertain parameters; see `pipeline.figures`."""
