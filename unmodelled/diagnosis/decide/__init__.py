"""The choice among fitted candidates: verdict, effects, confidence, and remarks on fitted numbers."""
