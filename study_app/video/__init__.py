"""Videos behind the tank's ball and targets: live from a camera, or footage from a file (optional extra ``video``)."""
