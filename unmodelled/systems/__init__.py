"""System files: expressions, units, reader, writer, equations as SymPy expressions; URDF and MJCF files.

May import: base.
"""
