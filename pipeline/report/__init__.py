"""The static report: read tables, figures and small JSON files, and write pages that open from disk."""
