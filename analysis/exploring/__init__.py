"""What is behind the page of `analysis/explore.py`: stands that are played, their players, and charts of them."""
