"""What is done to recorded paths: outliers, gaps, repeats, smoothing, cuts."""
