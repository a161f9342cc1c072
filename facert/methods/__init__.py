"""Every retargeting method behind one small interface, `facert.methods.base.Method`."""
