"""A reader of HDF5 files that no file can hang, crash or make take more than it declares.

The HDF5 library, in C, ends in endless loops and in wrong memory on damaged files, and nothing in
Python stops that. What facert reads of HDF5 is little: groups, attributes, and arrays of numbers
and names. Here these are read with Python, NumPy and zlib alone, after the HDF5 File Format
Specification, versions 1 to 3: whatever the bytes say, an exception is the worst that follows.
`facert.io.hdf5` is the door to it.
"""
