"""Diagnoses from inputs to files: sentences, diagnosis.json, tables and the augmented system."""
