"""Families of distributions of an uncertain parameter (section 3.2.4), one file each."""

from unmodelled.uncertainty.families.clipped_normal import ClippedNormal
from unmodelled.uncertainty.families.family import Family
from unmodelled.uncertainty.families.truncated_normal import TruncatedNormal

__all__ = ["ClippedNormal", "Family", "TruncatedNormal"]
