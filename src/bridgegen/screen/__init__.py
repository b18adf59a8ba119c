"""What a person sees in the terminal: progress bars and tables."""
