"""What acts on a robot by what it does: linear models, and what is made with them."""
