"""Faults of logs: is it the machine, or how it was logged?"""
