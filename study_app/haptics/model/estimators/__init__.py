"""What is known of the velocity estimators without compiling them."""
