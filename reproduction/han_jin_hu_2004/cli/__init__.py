"""Commands that this distribution adds to `vibroimpact`, by the entry points of its pyproject."""
