"""Many scenario files, with all their variations, run and judged together."""
