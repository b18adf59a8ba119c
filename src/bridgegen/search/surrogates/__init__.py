"""Models of the objective, learnt from the rows evaluated so far, for searches that are guided."""
