"""One page of HTML of all figures."""
