"""Kinds of numpy arrays, by the names that all annotations use."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]
