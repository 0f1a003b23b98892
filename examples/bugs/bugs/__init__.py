"""A benchmark of searches for the causes of failures: cases, a judge, strategies and a table. See ../README.md."""
