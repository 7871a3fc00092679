"""Basics of every room: refusals of bad input, files, tables, progress, processes, words of answers.

May import: none.
"""
