"""Figures of the diagnosis of a gap; their tables lie beside them in the output folder."""
