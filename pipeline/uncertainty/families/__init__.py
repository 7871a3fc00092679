"""Families of distributions of an uncertain parameter (table 3.1 and beyond), one file each."""

from pipeline.uncertainty.families.beta import Beta
from pipeline.uncertainty.families.clipped_normal import ClippedNormal
from pipeline.uncertainty.families.family import Family
from pipeline.uncertainty.families.gamma import Gamma
from pipeline.uncertainty.families.gaussian import Gaussian
from pipeline.uncertainty.families.truncated_normal import TruncatedNormal
from pipeline.uncertainty.families.uniform import Uniform

__all__ = ["Beta", "ClippedNormal", "Family", "Gamma", "Gaussian", "TruncatedNormal", "Uniform"]
