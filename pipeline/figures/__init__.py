"""Figures of the report: one public function per figure, `(data folder) -> Figure`, which reads tables only.

The stage `draw` calls it inside `unmodelled.report.figures.style.style`.

The first line of a figure's docstring is its caption; the second paragraph says what the reader should see.
Examples are chosen from the tables by a rule, so that every figure works for any campaign.
"""
