"""Hybrid physics-based neural network models of mechatronic systems, as a pipeline of stages."""
