"""The views of the explorer, one file each: a figure, and how it shows a result."""
