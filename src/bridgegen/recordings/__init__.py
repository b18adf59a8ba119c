"""What is made of recorded traffic: what was recorded, and where on lanes it was."""
