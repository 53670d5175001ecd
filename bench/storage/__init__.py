"""Records of attempts, and the file that holds them."""
