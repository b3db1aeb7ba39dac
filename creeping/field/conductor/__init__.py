"""Currents, charges and fields on and near a perfect conductor."""
