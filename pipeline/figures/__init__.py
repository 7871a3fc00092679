"""Figures of the report: one public function per figure, `(data folder) -> Figure`, reading tables only.

The first line of a figure's docstring is its caption, the second paragraph says what to see in it. Examples
are chosen by rule from the tables, so that every figure works on any campaign.
"""
