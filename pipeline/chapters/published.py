"""Numbers published in the dissertation, for comparison with the computed numbers.

The text has no page numbers; a place is the number of a section, table or figure.
"""

STROKES = (0.01, 0.03, 0.05, 0.07)  # m
SKEWS = (0.5, 0.75, 1.0, 1.25, 1.5)  # rise angle over pi

#: Table 5.1a: smallest |radius of curvature| over the roller's radius, one row a stroke. The caption divides
#: by the base radius; the numbers do not.
CURVATURE = (
    (1.98, 2.50, 2.50, 2.50, 1.98),
    (1.84, 2.50, 2.50, 2.50, 1.84),
    (1.12, 2.50, 2.50, 2.50, 1.12),
    (0.86, 2.43, 2.50, 2.43, 0.86),
)

#: Table 5.1b: largest pressure angle during the rise, degrees.
PRESSURE = (
    (21, 14, 11, 9, 7),
    (40, 31, 24, 20, 17),
    (49, 39, 32, 27, 23),
    (54, 45, 38, 32, 28),
)

#: Trajectories without a jump, section 6.5.
NOMINAL = 754
