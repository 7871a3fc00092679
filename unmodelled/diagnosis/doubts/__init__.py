"""Doubts: which numbers of an answer make no sense, or are not determined, and how sure it may be."""
