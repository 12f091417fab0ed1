"""The report of `cdpr discover`, looked at in a browser."""
