"""Tests, the references they judge by, and the fuzzing.

A package, since other distributions install a ``tests`` of theirs, which would come before a folder without this file.
"""
