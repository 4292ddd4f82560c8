"""Regressors to compare with: trained on many demonstrations of base tasks, adapted to novel ones."""
