"""Geodesics of a body, each by direct integration; knows no waves."""
