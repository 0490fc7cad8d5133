"""Stage 1: link file → finite element model → modes → modal body.

`modal_body` needs NumPy alone and `modal_body_file` adds h5py; stage 2 imports only those. Nothing is imported here.
"""
