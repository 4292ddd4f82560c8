"""CoppeliaSim's model files (.ttm): read them, and make MuJoCo scenes of them."""
