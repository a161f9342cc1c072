"""Every retargeting method behind one small interface."""
