"""The figures of Section V: each a function of plain data and a theme."""
