"""Functions and results of `import unmodelled as um`, with their figures and pages; examples with logs.

May import: base, systems, effects, logs, learning, diagnosis, report, design.
"""
