"""The static report: reads tables, figures and small JSON files, writes pages that open from disk."""
