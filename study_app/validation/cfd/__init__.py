"""A ball in a viscous liquid by a fluid solver: a truth for the force that none of our models had a part in.

``case`` says which liquids and motions, ``flow`` solves them (with the extra ``cfd``), ``solve`` checks and stores what
comes out: the ``*.csv`` in this folder, which are read by ``tables`` without the extra. ``fitted`` fits models to
them, ``compared`` says in words and ``drawn`` in a figure how well they do.
"""
