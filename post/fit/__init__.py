"""Constants of materials from measured data."""
