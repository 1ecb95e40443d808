"""What is made of many searches: sweeps, the paper's studies, the number of joints, comparisons."""
