"""The whole graph, killed again and again: python -m tests.survival --help"""
