"""Short motions of random linkages, judged by what any right motion keeps."""
