"""Pictures and comparisons from igaform's results files. Run as `python -m post`."""
