"""Families of distributions of an uncertain parameter (table 3.1 and beyond), one file each."""

from unmodelled.uncertainty.families.beta import Beta
from unmodelled.uncertainty.families.clipped_normal import ClippedNormal
from unmodelled.uncertainty.families.family import Family
from unmodelled.uncertainty.families.gamma import Gamma
from unmodelled.uncertainty.families.gaussian import Gaussian
from unmodelled.uncertainty.families.truncated_normal import TruncatedNormal
from unmodelled.uncertainty.families.uniform import Uniform

__all__ = ["Beta", "ClippedNormal", "Family", "Gamma", "Gaussian", "TruncatedNormal", "Uniform"]
