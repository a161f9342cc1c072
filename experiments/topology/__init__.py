"""The experiments of Zhang, Li and Liang (2017), section 4, on real recordings."""
